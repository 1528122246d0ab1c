"""Kept results that somebody else has made are never used, whatever they look like, and never stop a start."""

from __future__ import annotations

import hashlib
import hmac
import json
import shutil
import stat
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from tribo import kept_results
from tribo.comparison.prediction import kept_faults
from tribo.kept_results import DamagedResultWarning, encoded, fault_of_kept, kept_or_made
from tribo.springblock.kept_runs import checksum_of, fault_of, write_columns

TRUE = {"friction": 0.5, "why": "measured"}
FORGED = {"friction": 9.9, "why": "forged"}
OTHER_KEY = b"k" * 32


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A private folder for the key of this test."""
    (tmp_path / "state").mkdir(mode=0o700)
    monkeypatch.setenv("TRIBO_STATE_DIR", str(tmp_path / "state"))
    kept_results._own_key.cache_clear()
    yield tmp_path / "state"
    kept_results._own_key.cache_clear()


def kept(folder: Path, name: str = "result") -> dict[str, object]:
    return kept_or_made(folder, name, 1, lambda: dict(TRUE), ("laws",))


def parts(content: bytes) -> tuple[bytes, bytes, bytes]:
    """What the result is made from, its signature, and its body."""
    head, _, body = content.partition(b"\n")
    stated = json.loads(head.rstrip(b",") + b"}")
    return stated["made_from"].encode(), stated["signed"].encode(), body


def written(key: bytes, body: bytes, signed: object) -> bytes:
    """A kept file with a right checksum and a signature that the forger gives."""
    checksum = hashlib.sha256(key + body).hexdigest()
    said = f', "signed": {json.dumps(signed.decode("latin-1"))}' if isinstance(signed, bytes) else str(signed)
    return f'{{"made_from": "{key.decode()}", "sha256": "{checksum}"{said},\n'.encode("latin-1") + body


def body_of(result: object) -> bytes:
    return b'"result": ' + json.dumps(result).encode() + b"}\n"


BODY = body_of(encoded(FORGED))


def with_key(name: bytes, key: bytes, body: bytes, secret: bytes) -> bytes:
    return hmac.digest(secret, name + b"\0" + key + body, "sha256").hex().encode()


SIGNATURES: dict[str, Callable[[bytes, bytes], object]] = {
    "none at all": lambda key, true: "",
    "an empty one": lambda key, true: b"",
    "null": lambda key, true: ', "signed": null',
    "true": lambda key, true: ', "signed": true',
    "a list": lambda key, true: ', "signed": []',
    "that of the true result": lambda key, true: true,
    "that of the true result in capitals": lambda key, true: true.upper(),
    "half of that of the true result": lambda key, true: true[:32],
    "zeros": lambda key, true: b"0" * 64,
    "the checksum": lambda key, true: hashlib.sha256(key + BODY).hexdigest().encode(),
    "a hash without a key": lambda key, true: hashlib.sha256(b"result\0" + key + BODY).hexdigest().encode(),
    "an empty key": lambda key, true: with_key(b"result", key, BODY, b""),
    "a key of zeros": lambda key, true: with_key(b"result", key, BODY, bytes(32)),
    "the key of another user": lambda key, true: with_key(b"result", key, BODY, OTHER_KEY),
    "the key of another user for another name": lambda key, true: with_key(b"diagnosis", key, BODY, OTHER_KEY),
    "what it is made from as the key": lambda key, true: with_key(b"result", key, BODY, key),
    "two, the true one last": lambda key, true: ', "signed": "x", "signed": ' + json.dumps(true.decode()),
    "two, the true one first": lambda key, true: f', "signed": {json.dumps(true.decode())}, "signed": "x"',
    "letters beyond ASCII": lambda key, true: "é".encode("latin-1") * 64,
    "a megabyte": lambda key, true: b"a" * 1_000_000,
}  # fmt: skip
RESULTS: dict[str, object] = {
    "no record of tribo": {"record": "os:system", "fields": [["command", "true"]]},
    "a record that is not there": {"record": "tribo.records:Nothing", "fields": []},
    "a record of other fields": {"record": "tribo.records:Doubt", "fields": [["colour", "red"]]},
    "a record without fields": {"record": "tribo.records:Doubt"},
    "a function of others": {"function": "os:getcwd"},
    "a module that is not there": {"function": "tribo.nothing:f"},
    "an array of another shape": {"array": "AAAA", "dtype": "<f8", "shape": [3]},
    "an array of objects": {"array": "AAAA", "dtype": "O", "shape": [1]},
    "an array that is no base64": {"array": "é", "dtype": "<f8", "shape": [1]},
    "an array of a type that is none": {"array": "", "dtype": "wrong", "shape": [0]},
    "an array of a shape in words": {"array": "", "dtype": "<f8", "shape": ["two"]},
    "the value of nothing before": {"again": 5},
    "itself": {"again": 0},
    "a table of unequal columns": {"table": [["a", [1]], ["b", [1, 2]]]},
    "a table that is none": {"table": 1},
    "a mapping with a list as a key": {"mapping": [[[1], 2]]},
    "a mapping that is none": {"mapping": [[1]]},
    "an unknown word": {"unknown": 1},
    "a tuple that is a number": {"tuple": 1},
}  # fmt: skip
BODIES: dict[str, bytes] = {
    "no JSON": b'"result": {}}}}\n',
    "cut off": BODY[:-10],
    "no result": b'"other": 1}\n',
    "nothing": b"",
    "not UTF-8": b'"result": "\xff\xfe"}\n',
    "nested without end": b'"result": ' + b"[" * 200_000 + b"]" * 200_000 + b"}\n",
    "two results": BODY[:-2] + b', "result": 1}\n',
    "NaN": b'"result": NaN}\n',
}


def test_what_nobody_has_touched_is_used_again(tmp_path: Path) -> None:
    kept(tmp_path)
    assert fault_of_kept(tmp_path / "result.json") == ""
    assert kept_or_made(tmp_path, "result", 1, lambda: pytest.fail("made again"), ("laws",)) == TRUE


def made_again(folder: Path, content: bytes) -> str:
    """What is said of a kept file of this content, whose result is made again."""
    (folder / "result.json").write_bytes(content)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert kept(folder) == TRUE
    (warning,) = said
    assert issubclass(warning.category, DamagedResultWarning)
    return str(warning.message)


@pytest.mark.parametrize("kind", SIGNATURES)
def test_a_result_with_a_forged_signature_is_made_again_and_said(tmp_path: Path, kind: str) -> None:
    kept(tmp_path)
    key, true, _ = parts((tmp_path / "result.json").read_bytes())
    said = made_again(tmp_path, written(key, BODY, SIGNATURES[kind](key, true)))
    assert "was not made by this user on this machine; it is made again" in said


@pytest.mark.parametrize("kind", [*RESULTS, *BODIES])
def test_a_malformed_result_is_made_again_even_with_the_right_signature(tmp_path: Path, kind: str) -> None:
    """A key that became known, or a version that kept other records, must not make every start fail."""
    kept(tmp_path)
    key, _, _ = parts((tmp_path / "result.json").read_bytes())
    body = body_of(RESULTS[kind]) if kind in RESULTS else BODIES[kind]
    signed = with_key(b"result", key, body, kept_results._own_key())
    if kind in ("two results", "NaN"):  # this user's own signature: they are what they say
        (tmp_path / "result.json").write_bytes(written(key, body, signed))
        assert kept(tmp_path) != FORGED
        return
    assert "cannot be read by this version" in made_again(tmp_path, written(key, body, signed))


@pytest.mark.parametrize("kind", [*RESULTS, *BODIES])
def test_a_malformed_result_of_another_user_is_made_again(tmp_path: Path, kind: str) -> None:
    kept(tmp_path)
    key, _, _ = parts((tmp_path / "result.json").read_bytes())
    body = body_of(RESULTS[kind]) if kind in RESULTS else BODIES[kind]
    signed = with_key(b"result", key, body, OTHER_KEY)
    assert "not made by this user" in made_again(tmp_path, written(key, body, signed))


def test_a_true_result_under_another_name_is_not_believed(tmp_path: Path) -> None:
    kept(tmp_path, "other")
    assert "not made by this user" in made_again(tmp_path, (tmp_path / "other.json").read_bytes())


def test_the_key_is_of_this_user_alone_and_lasts(tmp_path: Path, own_state: Path) -> None:
    kept(tmp_path)
    path = own_state / "kept-results.key"
    before = path.read_bytes()
    assert len(before) == 32
    assert stat.S_IMODE(own_state.stat().st_mode) == 0o700
    kept_results._own_key.cache_clear()
    assert kept_or_made(tmp_path, "result", 1, lambda: pytest.fail("made again"), ("laws",)) == TRUE
    assert path.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"short", b"x" * 100])
def test_a_damaged_key_is_made_anew_and_what_it_signed_is_made_again(
    tmp_path: Path, own_state: Path, content: bytes
) -> None:
    kept(tmp_path)
    (own_state / "kept-results.key").write_bytes(content)
    kept_results._own_key.cache_clear()
    with pytest.warns(DamagedResultWarning, match="was not made by this user on this machine"):
        assert kept(tmp_path) == TRUE
    assert len((own_state / "kept-results.key").read_bytes()) == 32


def test_a_key_in_a_folder_that_others_may_write_to_is_not_used(tmp_path: Path, own_state: Path) -> None:
    (own_state / "kept-results.key").write_bytes(OTHER_KEY)
    own_state.chmod(0o777)
    assert kept_results._own_key() != OTHER_KEY


def store(path: Path, friction: float = 0.5) -> Path:
    """A store of one run, as this user keeps it."""
    about = {"title": "runs", "columns": ["static_friction", "done"], "design": "d", "sources": "s"}
    columns = {"run": np.arange(1), "static_friction": np.array([friction]), "done": np.ones(1, np.uint8)}
    return write_columns(path, "run", {n: (v, {"units": "1"}) for n, v in columns.items()}, about, signed=True)


def resigned(path: Path, secret: bytes | None) -> None:
    with h5py.File(path, "r+") as file:
        file["static_friction"][0] = 9.9
        file.attrs["checksum"] = checksum_of(file)
        if secret is not None:
            file.attrs["signed"] = hmac.digest(secret, str(file.attrs["checksum"]).encode(), "sha256").hex()


STORES: dict[str, Callable[[Path], object]] = {
    "another number with its checksum": lambda path: resigned(path, None),
    "the key of another user": lambda path: resigned(path, OTHER_KEY),
    "an empty key": lambda path: resigned(path, b""),
    "no signature": lambda path: without(path, "signed"),
    "a number as signature": lambda path: with_signature(path, 5),
    "an array as signature": lambda path: with_signature(path, [1, 2]),
    "a true file of another store": lambda path: signed_elsewhere(path),
}


def without(path: Path, name: str) -> None:
    resigned(path, None)
    with h5py.File(path, "r+") as file:
        del file.attrs[name]


def with_signature(path: Path, value: object) -> None:
    resigned(path, None)
    with h5py.File(path, "r+") as file:
        file.attrs["signed"] = value


def signed_elsewhere(path: Path) -> None:
    true = store(path.with_name("other.nc"), 0.7)
    with h5py.File(true) as file:
        signed = file.attrs["signed"]
    true.unlink()
    with_signature(path, signed)


@pytest.mark.parametrize("kind", STORES)
def test_forged_runs_are_not_believed_and_verify_says_so(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tribo.springblock.kept_runs.fingerprint", lambda design, work: "d")
    monkeypatch.setattr("tribo.springblock.kept_runs.sources", lambda *rooms: "s")
    (tmp_path / "kept").mkdir()
    path = store(tmp_path / "kept" / "F@1Pa-0.nc")
    assert fault_of([], path) is None
    assert kept_faults(tmp_path / "kept") == {path.name: ""}
    STORES[kind](path)
    fault = fault_of([], path)
    assert fault is not None
    assert "was not made by this user on this machine" in fault.what
    assert kept_faults(tmp_path / "kept") == {path.name: "was not made by this user on this machine"}


def test_fifty_kinds_of_forgery_are_tried() -> None:
    assert len(SIGNATURES) + len(RESULTS) + len(BODIES) + len(STORES) >= 50


def test_a_conclusion_that_another_user_put_into_kept_does_not_reach_a_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The forger has tribo, the campaign and OUT, and signs with a key of his own."""
    from on_the_command_line import run
    from support.campaigns import small

    campaign, out, foreign = small(tmp_path / "campaign", 7), tmp_path / "out", tmp_path / "foreign"
    assert run("fit", campaign, "-o", out, "-q").exit_code == 0
    true = (out / "fits.csv").read_bytes()
    (tmp_path / "forger").mkdir(mode=0o700)
    monkeypatch.setenv("TRIBO_STATE_DIR", str(tmp_path / "forger"))
    kept_results._own_key.cache_clear()
    shutil.copytree(out, foreign)
    shutil.rmtree(foreign / "kept")
    forged = "Forged: this sample is twice as slippery."
    with monkeypatch.context() as patched:
        patched.setattr("tribo.stages.assess", lambda study, options: assessed(study, options, forged))
        assert forged in run("fit", campaign, "-o", foreign, "-q").stdout
    monkeypatch.setenv("TRIBO_STATE_DIR", str(tmp_path / "state"))
    kept_results._own_key.cache_clear()
    verified = run("verify", foreign)
    assert "kept/assessment.json was not made by this user on this machine; it is not used" in verified.stdout
    result = run("fit", campaign, "-o", foreign, "-q")
    assert forged not in result.stdout
    assert "was not made by this user on this machine; it is made again" in result.stderr
    assert (foreign / "fits.csv").read_bytes() == true


def assessed(study, options, forged: str):
    from dataclasses import replace

    from tribo.fitting.assessment import assessment
    from tribo.stages import ASSESSED_BY

    made_from = (study.ingested, study.fits, options.weights)
    found = kept_or_made(
        options.kept, "assessment", made_from, lambda: {**assessment(*made_from), "power": (forged,)}, ASSESSED_BY
    )
    return replace(study, **found)
