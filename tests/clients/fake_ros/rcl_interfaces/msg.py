class ParameterDescriptor:
    def __init__(self, *, name="", description="", read_only=False):
        self.name, self.description, self.read_only = name, description, read_only
