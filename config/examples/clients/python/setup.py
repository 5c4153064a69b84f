# For colcon, which finds Python packages by setup.py and setup.cfg; pip reads pyproject.toml.
from setuptools import setup

setup()
