"""The check of reports finds outside addresses where there are some, and none in a report."""

import importlib.util
import json
from pathlib import Path

import pytest
from tests.scripts import told

SCRIPT = Path(__file__).parents[2] / "studies" / "check_reports.py"
pytest.importorskip("viser", reason='needs the extra "viz": pip install -e ".[viz]"')


def test_report_of_a_scenario_passes_the_check(tmp_path: Path) -> None:
    given = ("planar6-stop", "--seconds", 0.5, "--out", tmp_path, "--json")
    (row,) = json.loads(told("studies/check_reports.py", *given))["rows"]
    assert row["broken"] == [] and row["replay"] and row["bytes"] > 500_000
    assert "1 reports, 0 of them break a rule" in (tmp_path / "check_reports-quick.md").read_text()


@pytest.mark.parametrize(
    "text",
    [
        '<img src="https://a.b/c.png">',
        '<a href="//a.b">x</a>',
        "<style>p { background: url('http://a.b') }</style>",
        '<p style="background: url(http://a.b)">',
        '<iframe srcdoc="&lt;img src=&quot;http://a.b&quot;&gt;"></iframe>',
    ],
)
def test_outside_addresses_are_found(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    spec = importlib.util.spec_from_file_location("check_reports", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert [address for address in module.Addresses(text).found if module.OUTSIDE.match(address)]
    assert not [a for a in module.Addresses('<a href="#top">x</a>').found if module.OUTSIDE.match(a)]
