"""The verdicts of a run as JUnit XML: a suite a scene, a case a renderer."""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

_NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(results: dict[str, Any]) -> str:
    """XML text. Disagreement is a failure, a failed renderer an error, an unsupported or missing one skipped."""
    root = ElementTree.Element("testsuites", name="crossray")
    for scene in results["scenes"]:
        cases = [scene["reference"], *scene["comparisons"]]
        suite = ElementTree.SubElement(root, "testsuite", name=_clean(scene["scene"]), timestamp=results["started"])
        counts = {"failure": 0, "error": 0, "skipped": 0}
        for picture in cases:
            if kind := _add_case(suite, scene["scene"], picture):
                counts[kind] += 1
        suite.set("tests", str(len(cases)))
        for kind, attribute in (("failure", "failures"), ("error", "errors"), ("skipped", "skipped")):
            suite.set(attribute, str(counts[kind]))
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_case(suite: ElementTree.Element, scene: str, picture: dict[str, Any]) -> str | None:
    """Append one case; returns what it counts as."""
    case = ElementTree.SubElement(
        suite,
        "testcase",
        classname=_clean(scene),
        name=_clean(picture["renderer"]),
        time=f"{picture['seconds'] or 0:.3f}",
    )
    if facts := _facts(picture):
        properties = ElementTree.SubElement(case, "properties")
        for name, value in facts.items():
            ElementTree.SubElement(properties, "property", name=name, value=_clean(value))
    kind, message = _finding(picture)
    if kind:
        ElementTree.SubElement(case, kind, message=_clean(message)).text = _clean(picture["log"])
    return kind


def _facts(picture: dict[str, Any]) -> dict[str, str]:
    """The pixels of each class, and what is approved."""
    facts = {name: str(number) for name, number in ((picture.get("pixels") or {}).get("explained") or {}).items()}
    if approval := picture.get("approval"):
        word = "expired" if approval["expired"] else "until"
        facts["approved"] = f"{approval['pixels']} pixels, {word} {approval['until']}: {approval['because']}"
    return facts


def _finding(picture: dict[str, Any]) -> tuple[str | None, str]:
    if picture["status"] == "failed":
        return "error", picture["reason"]
    if picture["status"] in ("unsupported", "not-installed"):
        return "skipped", picture["reason"]
    if "verdict" in picture and picture["verdict"] is None:
        return "skipped", picture["reason"]
    if picture.get("verdict") == "disagree":
        pixels = picture["pixels"]
        message = f"{pixels['unexplained']} of {pixels['total']} pixels differ and are not explained"
        approval = picture.get("approval")
        if approval and approval["expired"]:
            message += f"; {approval['pixels']} of them were approved until {approval['until']}"
        elif approval:
            message += f"; {approval['pixels']} of them are approved"
        return "failure", message
    return None, ""


def _clean(text: str) -> str:
    """Without the characters that XML cannot hold."""
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)
