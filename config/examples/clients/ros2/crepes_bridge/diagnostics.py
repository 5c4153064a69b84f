"""diagnostic_msgs from STATUS, as pure functions: nested dicts of the messages' fields."""
from crepes_bridge.conversion import time_of

OK, WARN, ERROR, STALE = (bytes([level]) for level in range(4))
_LEVEL_OF_MODE = {"direct": OK, "graph": OK, "predicted": WARN}


def entry(name, robot, level, message, values):
    """diagnostic_msgs/DiagnosticStatus; values that are None are left out."""
    return {
        "level": level,
        "name": name,
        "message": message,
        "hardware_id": robot,
        "values": [{"key": key, "value": str(value)} for key, value in values.items() if value is not None],
    }


def sensor_entry(prefix, robot, sensor):
    values = {"rate_hz": sensor.rate_hz, **sensor.counts, **sensor.faults}
    return entry(f"{prefix}: sensor {sensor.name}", robot, OK if sensor.ok else ERROR,
                 sensor.message or ("ok" if sensor.ok else "fault"), values)


def neighbor_entry(prefix, robot, neighbor):
    """Mode, and where there is no pose the reason. What contradicts the team is a warning."""
    name = neighbor.name or f"robot {neighbor.peer}"
    level = WARN if neighbor.faults else _LEVEL_OF_MODE.get(neighbor.state, WARN)
    message = f"no pose: {neighbor.reason}" if neighbor.state == "none" else str(neighbor.state)
    values = {"peer": neighbor.peer, "mode": neighbor.state, "reason": neighbor.reason, "age_s": neighbor.age_s}
    values.update({f"fault {number}": text for number, text in enumerate(neighbor.faults, start=1)})
    return entry(f"{prefix}: neighbor {name}", robot, level, message, values)


def robot_entry(prefix, robot, status):
    values = {"uptime_s": status.uptime_s, "truncated": status.truncated,
              "neighbors left out": ", ".join(map(str, status.more)) or None}
    values.update({f"clock of {clock.peer} minus ours [s]": clock.offset_s for clock in status.clocks})
    return entry(f"{prefix}: robot", robot, WARN if status.faults else OK, "; ".join(status.faults) or "ok", values)


def bridge_entry(place, silent_s, patience_s, version, stamps):
    """The connection itself, and how stamps become ROS time."""
    silent = silent_s > patience_s
    values = {"daemon": place, "release": version.release if version else None, "stamps": stamps.method,
              "ROS time minus daemon's clock [ns]": stamps.offset_ns}
    return entry("crepes: bridge", "", ERROR if silent else OK,
                 f"no answer from {place}" if silent else "connected", values)


def entries_of(status):
    """Robot, sensors and neighbors of one STATUS."""
    robot = f"robot_{status.self_id}"
    prefix = f"crepes {status.name or robot}"
    return [robot_entry(prefix, robot, status),
            *(sensor_entry(prefix, robot, sensor) for sensor in status.sensors),
            *(neighbor_entry(prefix, robot, neighbor) for neighbor in status.neighbors)]


def array(ros_ns, entries):
    """diagnostic_msgs/DiagnosticArray."""
    return {"header": {"stamp": time_of(ros_ns), "frame_id": ""}, "status": entries}
