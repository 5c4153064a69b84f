"""As much of launch as the launch file uses: values that a test can look at."""


class LaunchDescription:
    def __init__(self, entities):
        self.entities = entities
