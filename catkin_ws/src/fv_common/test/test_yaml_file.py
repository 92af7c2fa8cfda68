"""YAML that is broken, says a thing twice, or would grow without end."""

import pytest

from fv_common.errors import ConfigError
from fv_common.yaml_file import read_yaml, read_yaml_text

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)
)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (BOMB, "aliases"),
        ("a: &a [*a]\n", "holds itself"),
        ("[" * 20000, "deep"),
        ("# " + "x" * (2 << 20), "more than 1048576"),
        ("a: 2001-99-99\n", "no valid YAML"),
        ("\x00", "no valid YAML"),
        ("a: 1\na: 2\n", "the key 'a' is there twice"),
        ("a: [1", "no valid YAML"),
    ],
    ids=["aliases", "circle", "deep", "long", "date", "zero", "twice", "open"],
)
def test_what_cannot_be_read_is_refused_in_a_line_that_names_the_file(tmp_path, content, words):
    path = tmp_path / "a.yaml"
    path.write_text(content)
    with pytest.raises(ConfigError, match=rf"^{path}: .*{words}") as caught:
        read_yaml(path)
    assert len(str(caught.value)) < 500 and "\n" not in str(caught.value)


def test_what_is_no_text_or_no_file_is_named(tmp_path):
    (tmp_path / "a.yaml").write_bytes(b"\xff\xfe\xff")
    for path, words in (
        (tmp_path / "a.yaml", "utf-8"),
        (tmp_path / "b.yaml", "No such file"),
        (tmp_path, "directory"),
    ):
        with pytest.raises(ConfigError, match=rf"^{path}: cannot be read: .*{words}"):
            read_yaml(path)


def test_honest_aliases_and_a_byte_order_mark_are_read(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("\ufeffa: &row {x: 1}\nb: *row\n", encoding="utf-8")
    assert read_yaml(path) == {"a": {"x": 1}, "b": {"x": 1}}
    assert read_yaml_text("", "nothing") is None
