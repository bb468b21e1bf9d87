"""Swings a motor to 90 degrees and back, with a controller that checks what the motor does (docs/start/tour.md)."""

import pathlib
import sys

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from joint_controller import Joint

with can.Bus(interface="socketcan", channel="vcan0") as vcan0:
    joint = Joint(vcan0, 1)
    for target_deg in (90, 0):
        joint.move_to(target_deg, speed_dps=90)
        print(f"at {target_deg} degrees", flush=True)
