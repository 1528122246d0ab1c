"""More than sixty mistakes: each with the place and the remedy that its message must name."""

from __future__ import annotations

from pathlib import Path

from mistakes.slips import (
    Mistake,
    each_row,
    exchanged,
    export,
    header,
    option,
    recorded,
    renamed,
    rows,
    text_of,
    toml,
    without,
    write_rows,
)  # fmt: skip


def _times(column: str, factor: float):
    return each_row(lambda row: {column: f"{float(row[column]) * factor:.6g}"})


def _as_load(factor: float):
    """mass_g replaced by normal_load_N: the number of newtons times ``factor``."""

    def make(folder: Path) -> None:
        table = rows(folder)
        for row in table:
            newton = (float(row.pop("mass_g")) + 1.5) * 9.80665e-3
            row["normal_load_N"] = f"{newton * factor:.6g}"
        write_rows(folder, table)

    return make


def _grams_as_newtons(folder: Path) -> None:
    header("mass_g", "normal_load_N")(folder)


def _decimal_commas(folder: Path) -> None:
    each_row(lambda row: {"speed_mm_s": "0,2", "mass_g": row["mass_g"].replace(".", ",")})(folder)


def _one_load(folder: Path) -> None:
    each_row(lambda row: {"mass_g": "50"})(folder)


def _close_loads(folder: Path) -> None:
    each_row(lambda row: {"mass_g": "50" if row["mass_g"] == "25" else "50.05"})(folder)


def _toml_for_the_folder(folder: Path) -> tuple[Path]:
    return (folder / "campaign.toml",)


def _an_export_for_the_folder(folder: Path) -> tuple[Path]:
    return (folder / "raw" / "T001.csv",)


def _exports_only(folder: Path) -> tuple[Path]:
    return (folder / "raw",)


def _typed_wrong(folder: Path) -> tuple[Path]:
    return (folder.parent / "campain",)


def _inside_the_campaign(folder: Path) -> tuple[object, ...]:
    return folder, "-o", folder / "out"


def _columns_of_another_machine(folder: Path) -> None:
    with (folder / "campaign.toml").open("a", encoding="utf-8") as stream:
        stream.write('[columns]\nforce = "Laod [N]"\n')


def _a_table_of_other_columns(folder: Path) -> None:
    with (folder / "campaign.toml").open("a", encoding="utf-8") as stream:
        stream.write('[columns]\nforce = "Extension [mm]"\n')


def _exports_of_the_next_row(folder: Path) -> None:
    table = rows(folder)
    files = [row["file"] for row in table]
    write_rows(folder, [row | {"file": file} for row, file in zip(table, files[1:] + files[:1], strict=True)])


def _no_export(folder: Path) -> None:
    (folder / "raw" / "T001.csv").unlink()


def _no_table(folder: Path) -> None:
    (folder / "tests.csv").unlink()


def _lever_arm(folder: Path) -> tuple[object, ...]:
    return folder, "--set", "lever_arm_mm=10"


def _results_into_a_file(folder: Path) -> tuple[object, ...]:
    (folder.parent / "results").write_text("x", encoding="utf-8")
    return folder, "-o", folder.parent / "results"


def _unknown_decision(folder: Path) -> tuple[object, ...]:
    (folder / "decisions.csv").write_text("test_id,action,reason\nt001,exclude,slipped\n", encoding="utf-8")
    return folder, "--overrides", folder / "decisions.csv"


TWO_CODINGS = ("\u00e91", "e\u03011")
REFUSED, LEFT_OUT, DOUBTED = (1,), (1, 3), (0,)
MISTAKES = (
    # what is given on the command line
    Mistake("campaign.toml given for the folder", _toml_for_the_folder, "campaign.toml", "give the folder", REFUSED),
    Mistake("an export given for the folder", _an_export_for_the_folder, "T001.csv", "give the folder", REFUSED),
    Mistake("the folder of exports given", _exports_only, "raw", "tribo init NEW --from raw", REFUSED),
    Mistake("a folder typed wrong", _typed_wrong, "campain", "did you mean .*campaign", (2,)),
    Mistake("results written into the campaign", _inside_the_campaign, "out", "outside of every campaign", REFUSED),
    Mistake("an unknown rule", option("--rule", "ASTM-D1894"), "--rule", r"did you mean astm_d1894\?", REFUSED),
    Mistake("unknown weights", option("--weights", "relativ"), "--weights", "'relative'", (2,)),
    Mistake("an unknown flat sample", option("--flat", "Q"), "--flat", "allowed: --flat F", REFUSED),
    Mistake("a patterned sample as the flat one", option("--flat", "B"), "has cavities", "--flat F", REFUSED),
    Mistake("overrides of a test that is not there",
            _unknown_decision, "decisions.csv, row 2", "did you mean T001", REFUSED),
    # campaign.toml
    Mistake("campaign.toml under another name", renamed("campaign.toml", "Campaign.toml.txt"), "campaign.toml",
            r"rename Campaign.toml.txt\?", REFUSED),
    Mistake("a decimal comma in campaign.toml",
            toml("= 55.0", "= 55,0"), "campaign.toml, row", "nominal_area_mm2 = 55.0", REFUSED),
    Mistake("a unit behind a number",
            toml("= 55.0", "= 55 mm2"), "campaign.toml, row", "nominal_area_mm2 = 55", REFUSED),
    Mistake("a number in quotation marks", toml("= 1.5", '= "1.5 g"'),
            "slider_mass_g", r"did you mean 1.5\?", REFUSED),
    Mistake("a text without quotation marks",
            toml('"PDMS"', "PDMS"), "campaign.toml, row", 'material = "PDMS"', REFUSED),
    Mistake("a key typed wrong",
            toml("slider_mass_g", "sled_mass_g"), "sled_mass_g", r"did you mean slider_mass_g\?", REFUSED),
    Mistake("a cavity spelled otherwise",
            toml('"circle"', '"circles"'), "patterns.B", r"did you mean circle\?", REFUSED),
    Mistake("an area fraction in percent",
            toml("pitch_um = [15.0", "area_fraction = 65\npitch_um = [15.0"), "area_fraction",
            "divide by 100", REFUSED),
    Mistake("a pitch smaller than the cavity",
            toml("[15.0, 15.0]", "[5.0, 5.0]"), "patterns.B", "pitch must be larger", REFUSED),
    Mistake("a pattern in millimetres", toml("diameter_um = 10.0\npitch_um = [15.0, 15.0]",
            "diameter_um = 0.010\npitch_um = [0.015, 0.015]"), "patterns.B", r"multiply by 1000\?", DOUBTED),
    Mistake("the area in cm2", toml("= 55.0", "= 0.55"), "nominal_area_mm2", r"cm2: multiply by 100\?", DOUBTED),
    Mistake("the area in m2", toml("= 55.0", "= 55e-6"), "nominal_area_mm2", "m2: multiply by 1000000", DOUBTED),
    Mistake("no flat sample",
            toml('[patterns.F]\ncavity = "none"\n', ""),
            r"tests.csv, row \d+, column sample", r"a table \[patterns.F\]", LEFT_OUT),
    # tests.csv
    Mistake("column names in capitals",
            header("^.*$", "TEST_ID,FILE,SAMPLE,SPECIMEN,DIRECTION,MASS_G,SPEED_MM_S,HOLD_S,"
            "REPEAT,RUN_ORDER,STARTED_AT,TEMPERATURE_C,HUMIDITY_PCT"),
            "column test_id", r"did you mean test_id\?", REFUSED),
    Mistake("a column named with a unit in brackets",
            header("mass_g", "Mass [g]"), "mass_g", r"did you mean mass_g\?", REFUSED),
    Mistake("a unit in a cell",
            each_row(lambda row: {"mass_g": f"{row['mass_g']} g"}),
            "row 2, column mass_g", r"did you mean 25\?|did you mean 138.5\?", REFUSED),
    Mistake("quoted decimal commas", _decimal_commas, "row 2, column speed_mm_s", r"did you mean 0.2\?", REFUSED),
    Mistake("a forgotten raw/",
            each_row(lambda row: {"file": Path(row["file"]).name}),
            "row 2, column file", r"did you mean raw/T001.csv\?", REFUSED),
    Mistake("file names without their ending",
            each_row(lambda row: {"file": row["file"][:-4]}),
            "row 2, column file", r"did you mean raw/T001.csv\?", REFUSED),
    Mistake("an export given twice",
            each_row(lambda row: {"file": "raw/T001.csv"}, 0, 3),
            "row 2, column file", "one export per test", LEFT_OUT),
    Mistake("a test_id given twice",
            each_row(lambda row: {"test_id": "T001"}, 0, 2), "column test_id", "one row per test", LEFT_OUT),
    Mistake("a sample in small letters",
            each_row(lambda row: {"sample": row["sample"].replace("F", "f")}),
            "column sample", r"did you mean F\?", LEFT_OUT),
    Mistake("a direction against the sample",
            each_row(lambda row: {"direction": "y"} if row["sample"] == "Sx" else None),
            "column direction", "or Sy in the column sample", LEFT_OUT),
    Mistake("one load only", _one_load, "sample B", "two or more loads for each sample", REFUSED),
    Mistake("loads 0.1 % apart", _close_loads, "tests.csv", "differ by a factor of two", (0, 1)),
    Mistake("the mass in kilograms", _times("mass_g", 1e-3), "mass_g", r"kilograms: multiply by 1000\?", DOUBTED),
    Mistake("grams typed as newtons", _grams_as_newtons, "loads", "grams: move it to a column mass_g", DOUBTED),
    Mistake("kilonewtons for newtons", _as_load(1e-3), "loads", "kilonewtons: multiply by 1000", DOUBTED),
    Mistake("the speed in mm/min", _times("speed_mm_s", 60), "displacement", r"mm/min: divide by 60\?", DOUBTED),
    Mistake("the temperature in kelvin",
            each_row(lambda row: {"temperature_C": f"{float(row['temperature_C']) + 273.15:.2f}"}),
            "temperature_C", r"subtract 273.15\?", DOUBTED),
    Mistake("the humidity as a fraction", _times("humidity_pct", 1e-2),
            "humidity_pct", r"multiply by 100\?", DOUBTED),
    Mistake("the humidity as a fraction in half of the tests",
            each_row(lambda row: {"humidity_pct": f"{float(row['humidity_pct']) / 100:.3g}"}, 0, 6),
            "in 6 of 12 tests", r"multiply by 100\?", DOUBTED),
    Mistake("a specimen in small letters",
            each_row(lambda row: {"specimen": row["specimen"].lower()}, 0, 1),
            "column specimen", r"spelled differently\?", DOUBTED),
    Mistake("a specimen under two samples",
            each_row(lambda row: {"specimen": "F1"} if row["specimen"] == "B1" else None),
            "column specimen", r"F1 \(B and F\); plausible: one pattern each", DOUBTED),
    Mistake("a slider that was not weighed",
            toml("slider_mass_g = 1.5\n", ""), "campaign.toml, slider_mass_g", "weigh sled and sample", DOUBTED),
    Mistake("a run order that was filled downwards with one number",
            each_row(lambda row: {"run_order": "1"}), "column run_order", "one number a test", DOUBTED),
    Mistake("a run order against the times",
            each_row(lambda row: {"run_order": str(40 - int(row["run_order"]))}),
            "column run_order and started_at", "the order of started_at", DOUBTED),
    Mistake("masses of some tests in kilograms",
            each_row(lambda row: {"mass_g": f"{float(row['mass_g']) / 1000:g}"}, 0, 4),
            "column mass_g", r"kilograms there: multiply by 1000\?", DOUBTED),
    Mistake("hold times of some tests in minutes",
            each_row(lambda row: {"hold_s": f"{float(row['hold_s']) / 60:.9g}"}, 0, 6),
            "hold time|column hold_s", r"minutes there: multiply by 60\?", DOUBTED),
    Mistake("temperatures in Fahrenheit",
            each_row(lambda row: {"temperature_C": f"{32 + 1.8 * float(row['temperature_C']):.1f}"}),
            "temperature_C", r"Fahrenheit: subtract 32", DOUBTED),
    Mistake("temperatures of some tests in Fahrenheit",
            each_row(lambda row: {"temperature_C": f"{32 + 1.8 * float(row['temperature_C']):.1f}"}, 0, 5),
            "in 5 of 12 tests", r"Fahrenheit: subtract 32", DOUBTED),
    Mistake("a slider of 150 g for 1.5 g",
            toml("slider_mass_g = 1.5", "slider_mass_g = 150"),
            "campaign.toml, slider_mass_g", r"about 1?\d(\.\d+)? would explain it|about \d", DOUBTED),
    Mistake("a negative run order",
            each_row(lambda row: {"run_order": str(int(row["run_order"]) - 5)}),
            "column run_order", "0 or more", DOUBTED),
    Mistake("a specimen in two codings of letters",
            each_row(lambda row: {"specimen": TWO_CODINGS[row["mass_g"] == "25"]} if row["specimen"] == "F1" else None),
            "column specimen", r"spelled differently\?", DOUBTED),
    # raw/
    Mistake("an export without units", export('"(s)","(mm)","(N)"\n', ""), "raw/T001.csv", "columns", REFUSED),
    Mistake("a column of another machine",
            _columns_of_another_machine, "raw/T001.csv", r"did you mean Load\?|did you mean Load \[N\]", REFUSED),
    Mistake("results written into a file", _results_into_a_file, "--out", "is a file", (2,)),
    Mistake("a lever arm for a recorded force", _lever_arm, "lever_arm_mm", "leave the lever arm out", DOUBTED),
    Mistake("campaign.toml saved as UTF-16",
            text_of("campaign.toml", lambda b: b.decode().encode("utf-16")), "campaign.toml", "UTF-8", REFUSED),
    Mistake("a table of campaign.toml in capitals",
            toml("[campaign]", "[Campaign]"), "Campaign", r"did you mean campaign\?", REFUSED),
    Mistake("the slider mass in kilograms",
            toml("= 1.5", "= 0.0015"), "slider_mass_g", r"kilograms: multiply by 1000\?", DOUBTED),
    Mistake("an area of zero", toml("= 55.0", "= 0"), "nominal_area_mm2", "greater than 0", REFUSED),
    Mistake("a circle with two lengths",
            toml("diameter_um = 10.0", "size_um = [10.0, 10.0]"), "patterns.B", "requires diameter_um", REFUSED),
    Mistake("a rectangle with a diameter",
            toml("size_um = [200.0, 40.0]", "diameter_um = 40.0"), "patterns.S", "requires size_um", REFUSED),
    Mistake("the gap between cavities given as the pitch",
            toml("[15.0, 15.0]", "[5.0, 5.0]"), "patterns.B", "pitch must be larger", REFUSED),
    Mistake("the extension stated as the force",
            _a_table_of_other_columns, "column Extension", "not a unit of friction force", REFUSED),
    # tests.csv again
    Mistake("no table of tests", _no_table, "tests.csv", "tests.csv, tests.xlsx or tests.ods", REFUSED),
    Mistake("the table of tests with a double ending",
            renamed("tests.csv", "tests.csv.csv"), "tests.csv", r"rename tests.csv.csv\?", REFUSED),
    Mistake("the columns of hold and speed exchanged", exchanged("hold_s", "speed_mm_s"), "T001.csv",
            "does not match the speed of the test", DOUBTED),
    Mistake("no column of samples", without("sample"), "column sample", "required column is missing", REFUSED),
    Mistake("no column of loads", without("mass_g"), "mass_g or normal_load_N", "required column is missing", REFUSED),
    Mistake("no column of specimens", without("specimen"), "column specimen", "a name for each", DOUBTED),
    Mistake("decimal commas that split the cells",
            text_of("tests.csv", lambda b: b.replace(b"0.2,", b"0,2,")), "row 2", "14 cells under 13", REFUSED),
    Mistake("a comma for thousands",
            each_row(lambda row: {"mass_g": "1,385"}, 0, 1), "row 2, column mass_g", "a decimal point", LEFT_OUT),
    Mistake("a row of units below the names",
            text_of("tests.csv", lambda b: b.replace(b"\n", b"\n,,,,,g,mm/s,s,,,,C,%\n", 1)),
            "row 2, column mass_g", "found 'g'", LEFT_OUT),
    Mistake("a row of means at the end",
            text_of("tests.csv", lambda b: b + b"Mean,,,,,80,,,,,,,\n"), "Mean", "no file is given", LEFT_OUT),
    Mistake("a path of another computer",
            each_row(lambda row: {"file": "C:\\data\\" + Path(row["file"]).name}), "row 2, column file",
            r"did you mean raw/T001.csv\?", REFUSED),
    Mistake("the folder of exports in capitals", renamed("raw", "Raw"), "row 2, column file",
            r"did you mean Raw/T001.csv\?", REFUSED),
    Mistake("a sample by its description",
            each_row(lambda row: {"sample": "flat"} if row["sample"] == "F" else None), "column sample",
            r"a table \[patterns.flat\]", LEFT_OUT),
    Mistake("a mass and another load",
            each_row(lambda row: {"normal_load_N": "1.0"}), "normal_load_N", "differs from the weight", REFUSED),
    Mistake("the mass in milligrams", _times("mass_g", 1e3), "mass_g", r"milligrams: divide by 1000\?", DOUBTED),
    Mistake("millinewtons for newtons", _as_load(1e3), "loads", r"millinewtons: divide by 1000\?", DOUBTED),
    Mistake("a negative mass",
            each_row(lambda row: {"mass_g": "-25"}, 0, 1), "row 2, column mass_g", "0 g or more", LEFT_OUT),
    Mistake("a mass in words",
            each_row(lambda row: {"mass_g": "heavy"}, 0, 1), "row 2, column mass_g", "allowed: a number", LEFT_OUT),
    Mistake("an empty mass", each_row(lambda row: {"mass_g": ""}, 0, 1), "T001", "normal load", LEFT_OUT),
    Mistake("the speed in m/s", _times("speed_mm_s", 1e-3), "displacement", r"m/s: multiply by 1000\?", DOUBTED),
    Mistake("another speed than was set", _times("speed_mm_s", 2.0), "displacement", "allowed: 0.4 mm/s", DOUBTED),
    Mistake("the hold in milliseconds", _times("hold_s", 1e3), "hold_s", r"milliseconds: divide by 1000\?", DOUBTED),
    Mistake("dates whose day and month cannot be told",
            each_row(lambda row: {"started_at": "03/04/2026 10:15 AM"}), "column started_at", "YYYY-MM-DD", REFUSED),
    Mistake("another year in one row",
            each_row(lambda row: {"started_at": row["started_at"].replace("2026", "2062")}, 0, 1),
            "run_order and started_at", "the order of started_at", DOUBTED),
    Mistake("a humidity beyond 100 %",
            each_row(lambda row: {"humidity_pct": "480"}), "humidity_pct", "0 to 100", DOUBTED),
    Mistake("one mass ten times too large",
            each_row(lambda row: {"mass_g": f"{float(row['mass_g']) * 10:g}"}, 4, 5),
            "T005", "a decimal point in the load", DOUBTED, True),
    # raw/ again
    Mistake("exports of the next row", _exports_of_the_next_row, "column file", "may be exchanged", DOUBTED),
    Mistake("a force that acts backwards", recorded(2, lambda x: -x), "T001.csv, column force",
            "sign may be reversed", REFUSED),
    Mistake("gram-force called newtons", recorded(2, lambda x: x / 9.80665e-3), "T/N", "gram-force", DOUBTED),
    Mistake("millinewtons called newtons", recorded(2, lambda x: x * 1e3), "T/N", "millinewtons", DOUBTED),
    Mistake("newtons called kilonewtons", export('"(N)"', '"(kN)"'), "T/N", "state the unit in", DOUBTED),
    Mistake("milliseconds called seconds", recorded(0, lambda x: x * 1e3), "displacement",
            "does not match the speed", DOUBTED),
    Mistake("metres called millimetres", recorded(1, lambda x: x / 1e3), "displacement",
            "does not match the speed", DOUBTED),
    Mistake("names of columns exchanged",
            export('"Time","Extension","Load"', '"Load","Extension","Time"'), "column Time", "not a unit of time",
            REFUSED),
    Mistake("records that end before the sled slips",
            text_of("raw/T001.csv", lambda b: b"\n".join(b.split(b"\n")[:40])), "T001",
            "ends before the static peak", LEFT_OUT),
    Mistake("an export that is not there", _no_export, "row 2, column file", "does not exist", LEFT_OUT),
    Mistake("an empty export", text_of("raw/T001.csv", lambda b: b""), "raw/T001.csv", "is empty", LEFT_OUT),
    Mistake("a page of the web for an export",
            text_of("raw/T001.csv", lambda b: b"<html><body>404</body></html>"), "raw/T001.csv",
            "no table of numbers", LEFT_OUT),
    Mistake("a PDF for an export",
            text_of("raw/T001.csv", lambda b: b"%PDF-1.4 \x00\x01"), "raw/T001.csv", "not a text file", LEFT_OUT),
)  # fmt: skip
