"""The bridge's parameters: for the node and the launch file alike."""
from typing import NamedTuple, Union


class Parameter(NamedTuple):
    name: str
    default: Union[str, int, float, bool]
    meaning: str

    def text(self):
        """The default as a launch argument."""
        return str(self.default).lower() if isinstance(self.default, bool) else str(self.default)


PARAMETERS = (
    Parameter("address", "127.0.0.1", "of the daemon; best run the bridge on the robot itself"),
    Parameter("port", 47475, "of the daemon's subscription"),
    Parameter("rate_hz", 0.0, "poses of each neighbor a second; 0: every pose"),
    Parameter("publish_odometry", True, "also crepes/<neighbor>/odometry"),
    Parameter("publish_tf", False, "neighbors as children of this robot; on one robot of a TF tree only"),
    Parameter("frame_format", "robot_{id}/base_link", "frame of a robot's body; {id} is its number"),
    Parameter("diagnostics_period_s", 1.0, "between messages on /diagnostics; above 0"),
)
