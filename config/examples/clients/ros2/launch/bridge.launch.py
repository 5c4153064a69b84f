"""ros2 launch crepes_bridge bridge.launch.py address:=192.168.1.7 publish_tf:=true"""
from crepes_bridge.parameters import PARAMETERS
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument(parameter.name, default_value=parameter.text(), description=parameter.meaning)
        for parameter in PARAMETERS
    ]
    values = {
        parameter.name: ParameterValue(LaunchConfiguration(parameter.name), value_type=type(parameter.default))
        for parameter in PARAMETERS
    }
    node = Node(package="crepes_bridge", executable="bridge", name="crepes_bridge", output="screen",
                parameters=[values])
    return LaunchDescription([*arguments, node])
