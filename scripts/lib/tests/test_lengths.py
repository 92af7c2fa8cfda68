"""The gate of long functions and files sees them, and takes a reason."""

from __future__ import annotations

import pytest
from lengths import cpp_functions, python_functions, too_long

LONG_PYTHON = "def short():\n    pass\n\n\ndef long():\n" + "    pass\n" * 60
LONG_CPP = (
    'namespace a {\nvoid f(int x) {\n  const char* s = "}";  // }\n' + "  g();\n" * 58 + "}\nvoid g() {}\n}\n"
)


def test_functions_are_found_with_their_lines():
    assert [(f.name, f.first, f.last) for f in python_functions(LONG_PYTHON)] == [
        ("short", 1, 2),
        ("long", 5, 65),
    ]
    assert [(f.first, f.last) for f in cpp_functions(LONG_CPP)] == [(2, 62), (63, 63)]


def test_classes_tables_and_raw_text_are_no_functions():
    text = 'struct A : B<int()> {\n  int x{0};\n};\nconst int table[] = {1, 2};\nauto t = R"({ f( { )";\n'
    assert list(cpp_functions(text)) == []


@pytest.mark.parametrize(("name", "text", "mark"), [("a.py", LONG_PYTHON, "# "), ("a.cpp", LONG_CPP, "// ")])
def test_a_long_function_is_named_unless_it_has_a_reason(tmp_path, name, text, mark):
    path = tmp_path / name
    path.write_text(text)
    (line,) = too_long(path)
    assert line.endswith(" has 61 lines; valid: up to 60, or a comment 'long: reason' beside it")
    assert line.count("has 61 lines") == 1
    definition = "def long" if name == "a.py" else "void f"
    path.write_text(text.replace(definition, f"{mark}long: a table\n{definition}"))
    assert too_long(path) == []


def test_a_long_file_is_named_unless_it_has_a_reason(tmp_path):
    path = tmp_path / "a.py"
    path.write_text("x = 1\n" * 401)
    assert "401 lines; valid: up to 400" in too_long(path)[0]
    path.write_text("# long: a table\n" + "x = 1\n" * 401)
    assert too_long(path) == []
