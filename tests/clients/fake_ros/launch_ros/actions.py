class Node:
    def __init__(self, *, package, executable, name, output, parameters):
        self.package, self.executable, self.name, self.parameters = package, executable, name, parameters
