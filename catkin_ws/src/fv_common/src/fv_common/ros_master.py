"""The way to a ROS master: a node without one says so and waits, a command says so and ends."""

from __future__ import annotations

import http.client
import sys
import time
import urllib.parse
import xmlrpc.client
from typing import Any

import rosgraph

from fv_common.errors import UserError

ANSWER_S = 3.0  # within which a master answers
POLL_S = 0.2


class _Impatient(xmlrpc.client.Transport):
    """What listens on the port but never answers is no master."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = ANSWER_S
        return connection


def master_uri() -> str:
    """ROS_MASTER_URI, checked.

    :raises UserError: it is no address of a master.
    """
    uri = str(rosgraph.get_master_uri())
    try:
        parts = urllib.parse.urlsplit(uri)
        good = parts.scheme == "http" and parts.hostname and parts.port
    except ValueError:
        good = False
    if not good:
        raise UserError(f"ROS_MASTER_URI is {uri!r}; valid: http://HOST:PORT, such as http://localhost:11311")
    return uri


def master_pid() -> int:
    """Process id of the ROS master that answers at ROS_MASTER_URI, 0 when none does. Errors as master_uri()."""
    master: Any = xmlrpc.client.ServerProxy(master_uri(), _Impatient())
    try:
        code, _, pid = master.getPid("/fv_common")
        return int(pid) if code == 1 else 0
    except (OSError, xmlrpc.client.Error, http.client.HTTPException, ValueError, LookupError, TypeError):
        return 0


def master_answers() -> bool:
    """Whether a ROS master answers at ROS_MASTER_URI. Errors as master_uri()."""
    return master_pid() != 0


def require_master() -> None:
    """For commands.

    :raises UserError: no master answers.
    """
    if not master_answers():
        raise UserError(f"no ROS master answers at {master_uri()}; start roscore")


def wait_for_master(program: str) -> None:
    """For nodes: return once a master answers; one line says so when that is not at once.

    :raises UserError: as master_uri().
    """
    if master_answers():
        return
    sys.stderr.write(
        f"{program}: no ROS master answers at {master_uri()}; waiting for one (roscore starts it)\n"
    )
    sys.stderr.flush()
    while not master_answers():
        time.sleep(POLL_S)


def missing_parameter(error: KeyError) -> str:
    """What to tell the user of rospy.get_param's KeyError, or of a key that is not in what it gave."""
    name = error.args[0] if error.args else "?"
    return f"parameter {name} is not set; rosrun hubo_description upload_robot --robot NAME sets those of a robot"
