"""XML files of a robot, read with care: size, encoding, and what XML can hide."""

from __future__ import annotations

import re
from pathlib import Path

from fv_common.yaml_file import read_bytes
from hubo_description.errors import RobotDescriptionError

LARGEST_XML = 16 << 20  # bytes; URDFs of whole humanoids have half a megabyte
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
_ENCODING = re.compile(rb"""^\s*<\?xml[^>]*encoding\s*=\s*["']([\w.-]+)["']""")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}


def read_xml(path: Path) -> str:
    """Return the text of an XML file without its declaration, whatever encoding that declares.

    :raises RobotDescriptionError: it cannot be read, or declares a document type: entities can grow without end.
    """
    content = read_bytes(path, LARGEST_XML)
    declared = _ENCODING.match(content)
    marked = next((name for mark, name in _MARKS.items() if content.startswith(mark)), None)
    encoding = marked or (declared[1].decode() if declared else "utf-8")
    try:
        text = content.decode(encoding)
    except (LookupError, UnicodeDecodeError) as err:
        raise RobotDescriptionError(f"{path}: cannot be read as {encoding}: {err}") from err
    if "<!DOCTYPE" in _COMMENT.sub("", text):
        raise RobotDescriptionError(f"{path}: has a <!DOCTYPE>, which is not read; remove it")
    return _DECLARATION.sub("", text, count=1)
