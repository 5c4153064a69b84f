from setuptools import setup

NAME = "crepes_bridge"

setup(
    name=NAME,
    version="0.3.0",
    description="Poses and status of a crepesd as ROS 2 topics",
    license="MIT",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/bridge.launch.py"]),
    ],
    install_requires=["setuptools", "crepes_client"],
    zip_safe=True,
    entry_points={"console_scripts": [f"bridge = {NAME}.bridge:main"]},
)
