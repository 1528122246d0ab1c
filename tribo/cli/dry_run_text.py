"""What a dry run found, in lines: the steps, then tests set aside, doubts and notes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tribo.cli.grouped_faults import doubts_text, faults_text, set_aside_text
from tribo.dry_run import Checked


def dry_run_text(found: Checked, out: Path, *, all_of_them: bool) -> str:
    """The result of a dry run but for the faults; equal ones are grouped unless ``all_of_them`` are asked for."""
    parts = [f"would {step}" for step in found.steps]
    if not found.faults:
        parts.append(f"would write into {out}")
    findings = findings_text(replace(found, faults=()), all_of_them=all_of_them)
    parts += [findings] if findings else []
    if not found.faults:
        clean = not (found.set_aside or found.doubts or found.used_with_doubts)
        parts.append(f"checked: {found.tests} tests can be used{'; nothing is doubtful' if clean else ''}")
    return "\n".join(parts)


def findings_text(found: Checked, *, all_of_them: bool) -> str:
    """Faults, doubtful numbers, tests set aside or used with doubts, and notes; empty where there is nothing to say."""
    parts = []
    groups = (
        ("fault", "", faults_text(found.faults, all_of_them=all_of_them), found.faults),
        ("doubtful number", "", doubts_text(found.doubts), found.doubts),
        ("test", "would be set aside", set_aside_text(found.set_aside, all_of_them=all_of_them), found.set_aside),
        ("test", "would be used with doubts", set_aside_text(found.used_with_doubts, all_of_them=all_of_them),
         found.used_with_doubts),
        ("note", "", faults_text(found.notes, all_of_them=all_of_them), found.notes),
    )  # fmt: skip
    for noun, what, text, items in groups:
        if items:
            number = f"{len(items)} {noun}{'s' if len(items) != 1 else ''}"
            parts.append(f"{number}{f' {what}' if what and noun == 'test' else ''}:\n{text}")
    return "\n".join(parts)
