"""Start of the simulator node: command line, errors, clean end."""

from __future__ import annotations

import sys

import rospy

from fv_common.ros_master import wait_for_master
from hubo_sim.errors import SimError
from hubo_sim.ros.node import SimNode
from hubo_sim.ros.params import robot_spec, sim_config
from hubo_sim.simulator import Simulator
from hubo_sim.worlds import list_worlds, load_world
from hubo_sim.worlds.kinds import KINDS

_HELP = """usage: rosrun hubo_sim sim_node [--list] [_world:=NAME] [_seed:=N] [_lockstep:=true] ...
Simulates the robot on the parameter server (rosrun hubo_description upload_robot --robot NAME) in a world.
  --list   print the worlds and what they are
Parameters and their defaults: config/sim.yaml."""


def print_worlds() -> None:
    """One line a world; of those that are made from a seed, what seed 0 makes."""
    for name in list_worlds():
        print(f"{name:14} {load_world(name).description}")
    for kind in KINDS:
        print(f"{kind + ':SEED':14} {load_world(kind).description} (any other seed: another one)")


def run_node() -> None:
    """Build the simulator from the parameter server and run it until shutdown. Raises SimError."""
    wait_for_master("sim_node")
    rospy.set_param("/use_sim_time", True)
    rospy.init_node("hubo_sim")
    config = sim_config()
    sim = Simulator(robot_spec(config.robot_timeout_s), load_world(config.world), config)
    try:
        SimNode(sim, config).run()
    finally:
        sim.close()


def main() -> int:
    """Exit status of the node."""
    args = rospy.myargv(sys.argv)[1:]
    try:
        if args in (["-h"], ["--help"]):
            print(_HELP)
        elif args == ["--list"]:
            print_worlds()
        elif args:
            raise SimError(f"unknown argument {' '.join(args)}; --list and --help are known")
        else:
            run_node()
    except (SimError, rospy.ROSInitException) as err:  # the latter: Ctrl-C while the node registers
        print(f"sim_node: {err}", file=sys.stderr)
        return 1
    except (KeyboardInterrupt, rospy.ROSInterruptException):
        return 0
    return 0
