class DeclareLaunchArgument:
    def __init__(self, name, *, default_value, description):
        assert isinstance(default_value, str)
        self.name, self.default_value, self.description = name, default_value, description
