"""However a command ends, it ends in one line, an exit code, and a log where nobody foresaw it."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fv_common import command
from fv_common.command import CUT_OFF, FAILED, INTERNAL, INTERRUPTED, MISUSED

SOURCES = Path(command.__file__).resolve().parents[1]


class Tool:
    """Runs a body of code as a command, with a log folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.logs = folder, folder / "logs"
        self.environment = {**os.environ, "ROS_LOG_DIR": str(self.logs)}
        path = [str(SOURCES), os.environ.get("PYTHONPATH", "")]
        self.environment["PYTHONPATH"] = os.pathsep.join(path)

    def words(self, body: str, *arguments: str) -> list[str]:
        lines = "\n".join(f"    {line}" for line in body.strip("\n").splitlines())
        text = f"def main():\n{lines}\nfrom fv_common.command import run\nrun(main)\n"
        script = self.folder / "tool"
        script.write_text(text)
        return [sys.executable, str(script), *arguments]

    def __call__(self, body: str, *arguments: str, **options) -> subprocess.CompletedProcess:
        options = {"capture_output": True, "text": True, "env": self.environment, **options}
        return subprocess.run(self.words(body, *arguments), timeout=60, **options)

    def log(self) -> str:
        return "".join(path.read_text() for path in sorted(self.logs.glob("tool-*-errors.log")))


@pytest.fixture
def tool(tmp_path) -> Tool:
    return Tool(tmp_path)


def test_what_a_command_returns_is_its_exit_code_and_leaves_no_log(tool):
    for value, code in (("None", 0), ("0", 0), ("3", 3)):
        done = tool(f"print('out')\nreturn {value}")
        assert (done.returncode, done.stdout, done.stderr) == (code, "out\n", "")
    assert list(tool.logs.iterdir()) == []


def test_what_nobody_foresaw_is_one_line_that_names_the_log(tool):
    done = tool("values = {}\nreturn values['there\\nis none']")
    assert done.returncode == INTERNAL
    (log,) = tool.logs.iterdir()
    assert done.stderr == f"tool: unexpected KeyError: 'there\\nis none' (log: {log})\n"
    assert "Traceback" in log.read_text() and "return values['there" in log.read_text()


def test_an_error_of_several_lines_becomes_one(tool):
    done = tool("raise ValueError('first\\n  second\\x1b[31m ' + 5000 * 'x')")
    assert done.stderr.startswith("tool: unexpected ValueError: first second\\x1b[31m xxx")
    assert done.stderr.count("\n") == 1
    assert len(done.stderr) < 2000


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("from fv_common.errors import UserError\nraise UserError('x is 3; valid: 1')", "x is 3; valid: 1"),
        ("open('/nothing/here')", "/nothing/here: No such file or directory"),
        ("open('/', 'w')", "/: Is a directory"),
        ("import os\nos.rename('/nothing', '/else')", "/nothing -> /else: No such file or directory"),
        ("raise MemoryError", "out of memory"),
        ("import errno\nraise OSError(errno.ENOSPC, 'x', 'a.png')", "the disk is full: a.png"),
        ("import errno\nraise OSError(errno.EDQUOT, 'x')", "the disk is full"),
        ("import sys\nsys.exit('words of its own')", None),
    ],
)
def test_what_users_cause_is_told_without_a_log(tool, body, told):
    done = tool(body)
    assert done.returncode == FAILED
    assert done.stderr == (f"tool: {told}\n" if told else "words of its own\n")
    assert not list(tool.logs.glob("*"))


def test_endless_recursion_is_one_line(tool):
    done = tool("def again():\n    again()\nagain()")
    assert done.returncode == INTERNAL
    assert done.stderr.startswith("tool: unexpected RecursionError: maximum recursion depth exceeded")
    assert done.stderr.count("\n") == 1


def test_no_memory_is_one_line(tool):
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30))

    done = tool("return len(bytearray(2**33))", preexec_fn=limit)
    assert (done.returncode, done.stderr) == (FAILED, "tool: out of memory\n")


def test_ctrl_c_is_one_line(tool):
    process = subprocess.Popen(
        tool.words("import time\nprint('ready', flush=True)\ntime.sleep(60)"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=tool.environment,
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30) == ("", "tool: interrupted\n")
    assert process.returncode == INTERRUPTED
    assert not list(tool.logs.glob("*"))


def test_ctrl_c_while_the_imports_run_ends_at_once(tool):
    (tool.folder / "slow.py").write_text(
        "import time\nprint('ready', flush=True)\ntime.sleep(60)\nmain = None\n"
    )
    script = tool.folder / "tool"
    script.write_text("from fv_common.command import run\nrun('slow:main')\n")
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=tool.environment,
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30) == ("", "")
    assert process.returncode == INTERRUPTED
    assert not list(tool.logs.glob("*"))


def test_a_module_that_cannot_be_imported_is_one_line(tool):
    script = tool.folder / "tool"
    script.write_text("from fv_common.command import run\nrun('no_such_module:main')\n")
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, env=tool.environment, timeout=60
    )
    assert done.returncode == INTERNAL
    assert done.stderr.startswith(
        "tool: unexpected ModuleNotFoundError: No module named 'no_such_module' (log: "
    )


def test_a_reader_who_leaves_is_no_error(tool):
    words = tool.words("for i in range(1000000):\n    print(i)")
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=tool.environment
    )
    process.stdout.readline()
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(30) == CUT_OFF


def test_a_reader_who_left_before_the_first_line_is_no_error(tool):
    read, write = os.pipe()
    os.close(read)
    done = tool("print('short')", capture_output=False, stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    assert (done.returncode, done.stderr) == (CUT_OFF, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_cannot_be_written_is_one_line(tool):
    with open("/dev/full", "w") as full:
        done = tool("print('short')", capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (FAILED, "tool: the disk is full\n")


def test_without_standard_files_it_works_and_keeps_their_numbers_free(tool):
    made = str(tool.folder / "made")
    body = f"import os\nfile = os.open({made!r}, os.O_CREAT | os.O_WRONLY)\nreturn 0 if file > 2 else 9"
    command = " ".join(tool.words(body)) + " <&- >&- 2>&-"
    done = subprocess.run(["sh", "-c", command], env=tool.environment, timeout=60)
    assert done.returncode == 0


def test_a_name_that_is_no_text_is_printed(tool):
    done = tool("import sys\nprint('file', sys.argv[1])", os.fsdecode(b"a\xff.pcd"))
    assert (done.returncode, done.stdout) == (0, "file a\\udcff.pcd\n")


def test_an_error_in_a_thread_is_one_line(tool):
    done = tool(
        "import threading\nt = threading.Thread(target=lambda: 1 / 0, name='worker')\nt.start()\nt.join()"
    )
    assert done.stderr.startswith(
        "tool: a thread ended (worker): unexpected ZeroDivisionError: division by zero (log: "
    )
    assert done.stderr.count("\n") == 1
    assert "Traceback" in tool.log()


def test_an_error_in_a_destructor_and_a_warning_stay_off_the_terminal(tool):
    body = """
import warnings
class Bad:
    def __del__(self):
        raise ValueError('in __del__')
Bad()
warnings.warn('a warning')
from fv_common.errors import Notice
warnings.warn('a notice', Notice)
raise KeyError('kept')
"""
    done = tool(body)
    assert done.stderr.startswith("tool: warning: a notice\ntool: unexpected KeyError")
    assert done.stderr.count("\n") == 2
    assert "in __del__" in tool.log() and "a warning" in tool.log()


def test_a_signal_leaves_where_each_thread_stood(tool):
    done = tool("import ctypes\nctypes.string_at(0)")
    assert done.returncode == -signal.SIGSEGV
    assert done.stderr == ""
    assert "Segmentation fault" in tool.log() and "string_at" in tool.log()


def test_native_output_goes_to_the_log_and_is_kept_when_something_goes_wrong(tool):
    body = """
import ctypes
from fv_common.native_output import native_output_hidden
print('before')
with native_output_hidden():
    ctypes.CDLL(None).puts(b'chatter')
print('after')
"""
    done = tool(body)
    assert (done.stdout, done.stderr, tool.log()) == ("before\nafter\n", "", "")
    assert "chatter" not in tool(body + "raise KeyError").stderr
    assert "chatter" in tool.log()


def test_what_rospy_says_of_a_failing_callback_is_one_line(tool):
    body = """
import logging, sys, traceback
logging.getLogger('rosout').addHandler(logging.StreamHandler(sys.stderr))
for _ in range(5):
    try:
        {}['key']
    except KeyError:
        logging.getLogger('rosout').error('bad callback: %s\\n%s', 'on_scan', traceback.format_exc())
logging.getLogger('rosout').error('ordinary: %s', 'words')
"""
    lines = tool(body).stderr.splitlines()
    assert [line.split(" (log: ")[0] for line in lines] == [
        "bad callback: on_scan: KeyError: 'key'",
        "bad callback: on_scan: KeyError: 'key', 2 times so far",
        "bad callback: on_scan: KeyError: 'key', 4 times so far",
        "ordinary: words",
    ]
    assert tool.log().count("{}['key']") == 3


def test_a_log_folder_that_cannot_be_made_is_no_reason_to_fail(tool):
    (tool.folder / "file").write_text("")
    places = {"ROS_LOG_DIR": "file/logs", "ROS_HOME": "file", "HOME": "file", "TMPDIR": "file"}
    environment = {**tool.environment, **{name: str(tool.folder / place) for name, place in places.items()}}
    done = tool("raise KeyError('x')", env=environment)
    assert done.returncode == INTERNAL
    assert done.stderr.startswith("tool: unexpected KeyError: 'x' (")
    assert done.stderr.count("\n") == 1


def test_a_wrong_command_line_is_one_line(tool):
    body = """
from fv_common.command import Parser
parser = Parser(prog='tool')
parser.add_argument('--size', type=int, choices=(1, 2))
parser.parse_args()
"""
    done = tool(body, "--size", "3")
    assert done.returncode == MISUSED
    assert (
        done.stderr
        == "tool: argument --size: invalid choice: 3 (choose from 1, 2); --help lists what is valid\n"
    )
    assert tool(body, "--help").stdout.startswith("usage: tool")


def test_nothing_is_left_when_it_is_killed_while_it_ends(tool):
    body = "import atexit, time\natexit.register(lambda: (print('ending', flush=True), time.sleep(60)))"
    process = subprocess.Popen(
        tool.words(body), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=tool.environment
    )
    assert process.stdout.readline() == "ending\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30) == ("", "")
    assert process.returncode == INTERRUPTED
