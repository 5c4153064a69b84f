"""The messages that the bridge fills, with the fields that the real ones have: a misspelt one fails."""


class Fields:
    def __init__(self, **fields):
        self.__dict__.update(fields)

    def __setattr__(self, name, value):
        if name not in self.__dict__:
            raise AttributeError(name)
        self.__dict__[name] = value


def vector():
    return Fields(x=0.0, y=0.0, z=0.0)


def quaternion():
    return Fields(x=0.0, y=0.0, z=0.0, w=1.0)


def header():
    return Fields(stamp=Fields(sec=0, nanosec=0), frame_id="")


class PoseWithCovarianceStamped(Fields):
    def __init__(self):
        pose = Fields(position=vector(), orientation=quaternion())
        super().__init__(header=header(), pose=Fields(pose=pose, covariance=[0.0] * 36))


class TransformStamped(Fields):
    def __init__(self):
        super().__init__(header=header(), child_frame_id="",
                         transform=Fields(translation=vector(), rotation=quaternion()))
