class ParameterDescriptor:
    def __init__(self, *, name="", description="", read_only=False, dynamic_typing=False):
        self.name, self.description, self.read_only, self.dynamic_typing = name, description, read_only, dynamic_typing
