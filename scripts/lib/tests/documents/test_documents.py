"""Every command that a document tells a reader to type is run, in the order in which it stands."""

from __future__ import annotations

import re
import time

import pytest
from documents import Command, all_documents, commands_of
from plan import AFTER, BEFORE, ENTRIES, PLACEHOLDERS, entry_of, write_inputs
from shell import Shell

DOCUMENTS = all_documents()
UNTIL_S = 120.0
LEFT_OVER = re.compile(r"(?<![\w$=:-])[A-Z]{3,}(_[A-Z]+)*(?![\w=:(])")


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    """One reader, who begins after scripts/setup and works through all documents in one folder."""
    from capability_map import default_map_path  # here: the other tests need no build

    folder = tmp_path_factory.mktemp("reader")
    built = default_map_path("hubo", "right_arm")  # the one that scripts/setup makes
    maps = folder / "data" / "capability_maps"
    maps.mkdir(parents=True)
    (maps / built.name).symlink_to(built.resolve())
    write_inputs(folder)
    one = Shell(folder)
    yield one
    one.end()


def form_of(text: str, document: str) -> str:
    """What is run for a command: its form in the plan, or the text without brackets and with placeholders filled in."""
    entry = entry_of(text)
    if entry.form:
        return entry.form.replace("PACKAGE", document)
    return fill_in(re.sub(r"[\[\]]", "", text) if "'" not in text else text)


def fill_in(text: str) -> str:
    for word, meaning in PLACEHOLDERS.items():
        text = re.sub(rf"(?<![\w]){re.escape(word)}(?!\w)", meaning, text)
    return text


def follow(shell: Shell, text: str, document: str) -> None:
    """Run one command as the plan says, and wait for what it is to bring about."""
    entry = entry_of(text)
    form = form_of(text, document).replace("-p PORT", f"-p {shell.port}")
    if entry.ready is not None:
        shell.start(form, entry.ready)
    else:
        shell.run(form, entry.timeout_s)
    if text in AFTER:
        AFTER[text](shell.folder)
    if entry.until:
        other, said = entry.until
        deadline = time.monotonic() + UNTIL_S
        while said not in shell.output_of(other):
            heard = shell.output_of(other)[-600:]
            assert time.monotonic() < deadline, f"'{other}' never said {said!r}: {heard}"
            time.sleep(0.2)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_command_runs(document, shell):
    commands = [Command(text, 0) for text in BEFORE.get(document, [])]
    commands += commands_of(DOCUMENTS[document].read_text())
    try:
        for command in commands:
            started = time.monotonic()
            try:
                follow(shell, command.text, document)
            except AssertionError as error:
                where = f"{DOCUMENTS[document]}:{command.line}"
                run_as = form_of(command.text, document)
                raise AssertionError(f"{where}: {command.text}\nrun as: {run_as}\n{error}") from None
            print(f"{time.monotonic() - started:6.1f} s  {document}:{command.line}  {command.text}")
    finally:
        shell.end()


EXAMPLE = """# A page
Say `rosrun` or `scripts/test`: mentions. Type `rosrun a b --c
D` and ``roscore -p 1``; not `python`, nor `a rosrun b c`.

| `rostopic list` | and `x` |

```sh
roscore            # a comment
rostopic pub -1 /a b '{c: 1,   # no comment
  d: 2}'
echo one \\
  two
```

```
a drawing isn't a command
rosrun in a drawing
```

```python
rosrun = 1
```

    cp x y   # copied
    -> not this

1. item
   goes on `cp in item`
    rosrun is prose here
"""


def test_commands_are_found_where_readers_find_them():
    found = [(command.line, command.text) for command in commands_of(EXAMPLE)]
    assert found == [
        (2, "rosrun a b --c D"),
        (3, "roscore -p 1"),
        (5, "rostopic list"),
        (8, "roscore"),
        (9, "rostopic pub -1 /a b '{c: 1,   # no comment\n  d: 2}'"),
        (11, "echo one \\\n  two"),
        (17, "rosrun in a drawing"),
        (24, "cp x y"),
        (28, "cp in item"),
    ]


@pytest.mark.parametrize("text", ["```sh\necho 'a\n```\n", "```sh\necho\n"])
def test_a_block_without_an_end_is_an_error(text):
    with pytest.raises(ValueError, match="has no end"):
        commands_of(text)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_no_command_escapes(document):
    """The plain way: wherever a program of ROS is followed by two words, outside of Python, a command was found."""
    text = re.sub(r"```python.*?```", "", DOCUMENTS[document].read_text(), flags=re.DOTALL)
    pattern = re.compile(r"\b(?:rosrun|rostopic|rosparam) +[\w-]+\s+[\w/<]+")
    said = [" ".join(match.split()) for match in pattern.findall(text)]
    found = [" ".join(match.split()) for one in commands_of(text) for match in pattern.findall(one.text)]
    assert sorted(found) == sorted(said)


def test_the_plan_names_nothing_that_no_document_says():
    said = {command.text for path in DOCUMENTS.values() for command in commands_of(path.read_text())}
    before = {text for texts in BEFORE.values() for text in texts}
    assert set(ENTRIES) - said - before == set()
    assert set(AFTER) - said == set()
    assert set(BEFORE) - set(DOCUMENTS) == set()


def test_no_placeholder_is_left_without_a_meaning():
    for document, path in DOCUMENTS.items():
        for command in commands_of(path.read_text()):
            form = form_of(command.text, document)
            left = LEFT_OVER.search(re.sub(r"'[^']*'|\"[^\"]*\"", "", form))
            assert left is None or left[0] in ("PORT",), f"{document}:{command.line}: {form}"
