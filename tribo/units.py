"""Physical quantities, units, and the columns that exports and tests.csv have: each declared once.

All unit conversions are done here (pint). Everything inside tribo is in SI units.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from tribo.errors import Problem, ReadError


@dataclass(frozen=True)
class Quantity:
    """A physical quantity; ``column`` is its SI column name, ``aliases`` the names it goes by in exports.

    These names are those of the programs of machines in their languages, plain as :func:`plain_name` makes them:
    without case, accents, units or punctuation. Where several columns of an export fit, the first name is preferred.
    """

    name: str
    si_unit: str
    column: str
    aliases: tuple[str, ...]


def _quantity(name: str, si_unit: str, column: str, names: str) -> Quantity:
    return Quantity(name, si_unit, column, tuple(alias.strip() for alias in names.split(",")))


QUANTITIES: dict[str, Quantity] = {
    q.name: q
    for q in (
        _quantity("time", "s", "time_s", """
            time, test time, step time, elapsed time, timestamp, time stamp, total time, run time, running time, zeit,
            prufzeit, laufzeit, versuchszeit, temps, temps d essai, duree, t, test zeit, temps ecoule, tiempo, tempo,
            tijd, total elapsed time, cycle elapsed time, czas, czas testu, aika, tid, cas, ido, zaman, sure, timp,
            messzeit, testzeit, relativzeit, zeitstempel, uhrzeit, relative time, rel time, time since start,
            sample time, sliding time, elapsed, seconds, sekunden, millis, milliseconds, temps de test, heure,
            tiempo de ensayo, hora, tempo de ensaio, tempo di prova, ora, czas pomiaru, godzina, время, час, χρονος,
            时间, 经过时间, 時刻, 试验时间, 時間, 試験時間, 経過時間, 測定時間, テスト時間, 测试时间, 시간
        """),
        _quantity("friction force", "N", "force_N", """
            friction force, friction, tangential force, traction force, frictionforce, lateral force, reibkraft,
            reibungskraft, force de frottement, load, force, standard force, standardkraft, prufkraft, kraft,
            force standard, fx, ff, ft, f, load cell, axial force, traction force 1, effort, last, tangential load,
            tangentialkraft, force tangentielle, horizontal force, pull force, pulling force, tensile force,
            frictional force, friction load, frictional load, fr, f r, f t, f x, f f, sled force, fuerza de friccion,
            forza di attrito, fuerza, forza, forca, kracht, carga, force x, fx force, daq fx, tensile load, zugkraft,
            charge, sila tarcia, sila, sila styczna, kitkavoima, voima, friktionskraft, friktion, wrijvingskracht,
            treci sila, sila treni, surtunme kuvveti, kuvvet, forta de frecare, forta, forca de atrito,
            forca de friccao, shear force, drag force, drag, sliding force, tan force, tang force, f fric, fh, f h,
            fl, f l, f lat, f drag, f tan, ffric, querkraft, horizontalkraft, gleitkraft, fuerza tangencial,
            forca tangencial, forza tangenziale, 水平力, 横向力, せん断力, 引張力, tangencialni sila, сила трения,
            сила, усилие, τριβη, 摩擦力, obciazenie, нагрузка, 力, 负荷, 切向力, 载荷, 試験力, 力值, 拉力, 摩擦荷重,
            摩擦抵抗, 摩擦抵抗力, 動摩擦力, 荷重, 마찰력, 하중, 힘
        """),
        _quantity("displacement", "m", "displacement_m", """
            extension, displacement, stroke, crosshead, crosshead position, position, standard travel, standardweg,
            course standard, weg, hub, course, deplacement, axial displacement, traverse, course traverse,
            traverse abs, traverse absolue, maschine, maschinenweg, machine displacement, linear position,
            sliding distance, distance, x position, x, dx, tensile extension, tensile displacement,
            crosshead displacement, crosshead travel, axial extension, grip to grip separation,
            absolute crosshead travel, crosshead absolute, actuator displacement, sled displacement, travel,
            desplazamiento, spostamento, deslocamento, verplaatsing, extension en traction, disp, displ,
            xyz x position, droga, przemieszczenie, wydluzenie, droga tarcia, siirtyma, matka, forskjutning,
            forflyttning, stracka, weglange, draha, posun, posuv, elmozdulas, yer degistirme, deplasare, recorrido,
            verfahrweg, verschiebung, verlangerung, schlittenweg, weg s, allongement, distance parcourue, posicion,
            distancia, posicao, extensao, posizione, distanza, estensione, allungamento, przesuw, pozycja, elongation,
            shear displacement, horizontal displacement, load point displacement, lp disp, carriage position,
            stage position, pos, 滑动距离, すべり距離, 位置, 移動量, 伸び, corsa, percorso, curso, traversenweg,
            querhauptweg, gleitweg, reibweg, kolbenweg, перемещение, путь, ход, 位移, 行程, 変位, ストローク,
            移動距離, 변위
        """),
        _quantity("normal force", "N", "normal_force_N", """
            normal force, normal load, vertical force, normal force fz, ball load, pin load, contact force,
            normalkraft, f n, f z, normal, contact load, specimen load, applied normal load, applied normal force,
            carico normale, carico, vertical load, down force, force normal, load normal, normalbelastung, normallast,
            anpresskraft, charge normale, effort normal, force normale, fz, fn, fz force, daq fz, nominal load,
            force z, carga normal, forza normale, fuerza normal, f normal, f norm, fv, f v, applied load,
            applied force, pressing force, clamp force, grip force, downforce, preload, auflast, belastung, pruflast,
            charge appliquee, carga aplicada, carico applicato, sila docisku, docisk, nacisk, 加载力, 押付荷重,
            押し付け力, sila normalna, obciazenie normalne, sila nacisku, normaalivoima, normaalkracht,
            normalova sila, pritlacna sila, normal kuvvet, forta normala, forca normal, нормальная сила,
            нормальная нагрузка, 法向力, 正压力, 法向载荷, 垂直力, 垂直荷重, 法線力, 押付力, 수직하중, 수직력
        """),
        _quantity("friction coefficient", "", "friction_coefficient", """
            cof, friction coefficient, coefficient of friction, friction coeff, coeff of friction, coef of friction,
            friction coef, frictional coefficient, friction factor, coefficient friction, cof mean, mean cof, avg cof,
            average cof, cof avg, cof average, dynamic cof, kinetic cof, mean friction coefficient,
            dynamic friction coefficient, kinetic friction coefficient, dynamic coefficient of friction,
            kinetic coefficient of friction, traction coeff, traction coefficient, fric coeff, daq cof, mu, reibwert,
            friction coefficient mu, reibwert mu, reibzahl mu, reibkoeffizient, gleitreibungszahl, cof dyn,
            coef de frottement, coef de friccion, coef de rozamiento, coef de atrito, coeficiente de friccao,
            coeff di attrito, coefficiente d attrito, wsp tarcia, 摩擦因数,
            coefficient de frottement, reibungskoeffizient, reibzahl, reibungszahl, coefficiente di attrito,
            coeficiente de friccion, cof mu, wspolczynnik tarcia, kitkakerroin, friktionskoefficient,
            wrijvingscoefficient, koeficient treni, surtunme katsayisi, coeficient de frecare, coeficiente de atrito,
            coeficiente de rozamiento, coefficient de friction, коэффициент трения, 摩擦系数, 摩擦係数,
            动摩擦系数, 動摩擦係数, 마찰계수
        """),
        _quantity("torque", "N m", "torque_Nm", """
            friction torque, torque, frictional torque, axial torque, spindle torque, measured torque, torque cell,
            friction moment, reibmoment, drehmoment, moment, couple,
            couple de frottement, moment de frottement, coppia, momento, par, koppel, moment tarcia, moment sily,
            момент, момент трения, 扭矩, 摩擦力矩, トルク, 摩擦トルク, 토크
        """),
        _quantity("temperature", "degC", "temperature_C", """
            temperature, temp, temperatur, ambient temperature, room temperature, raumtemperatur, temperature c,
            temperatura, temperature ambiante, lampotila, teplota, sicaklik, температура, 温度, 온도
        """),
        _quantity("humidity", "percent", "humidity_pct", """
            humidity, relative humidity, rh, feuchte, luftfeuchte, humidite, luftfeuchtigkeit, relative luftfeuchte,
            wilgotnosc, humedad, umidita, humidade, vochtigheid, kosteus, luftfuktighet, vlhkost, nem, влажность,
            湿度, 습도
        """),
        _quantity("speed", "m/s", "speed_m_s", """
            sliding velocity, sliding speed, speed, velocity, geschwindigkeit, gleitgeschwindigkeit, vitesse,
            disc speed, disk speed, motor speed, drive speed, tachometer, tacho, linear speed, linear velocity,
            vitesse de glissement, gleitgeschw, predkosc, predkosc poslizgu, predkosc liniowa, velocidad,
            velocita, velocidade, snelheid, belt velocity, velocidad de deslizamiento, velocita di strisciamento,
            predkosc slizgania,
            nopeus, hastighet, rychlost, hiz, viteza, скорость, скорость скольжения, 速度, 滑动速度, すべり速度,
            摺動速度, 线速度, 속도
        """),
        _quantity("rotation speed", "revolution/s", "rotation_rev_per_s", """
            rotation speed, rotational speed, rotary speed, spindle speed, rotational velocity, rotation rate,
            revolution speed, angular velocity, angular speed, rotacao, rpm, drehzahl, vitesse de rotation,
            velocidad de giro, velocita di rotazione, toerental, rotary velocity, predkosc obrotowa, obroty, otacky,
            pyorimisnopeus, varvtal, скорость вращения, 转速, 回転数, 回転速度, 회전수
        """),
        _quantity("frequency", "Hz", "frequency_Hz", """
            frequency, oscillation frequency, stroke frequency, freq, frequenz, frequence, frecuencia, frequenza,
            frequencia, czestotliwosc, частота, 频率, 周波数, 振动频率, 주파수
        """),
        _quantity("radius", "m", "radius_m", """
            radius, track radius, wear track radius, disc track radius, sliding radius, bahnradius, laufradius, rayon,
            raggio, radio, promien, polomer, радиус, 半径, 반경
        """),
        _quantity("shear stress", "Pa", "shear_stress_Pa", """
            shear stress, shearstress, shear traction, friction stress, scherspannung, schubspannung,
            contrainte de cisaillement, contrainte tangentielle, naprezenie styczne, shr stress, 剪应力, 剪切应力,
            せん断応力, 전단응력
        """),
        _quantity("normal stress", "Pa", "normal_stress_Pa", """
            normal stress, effective normal stress, nor stress, effns, normalspannung, contrainte normale,
            naprezenie normalne, 正应力, 法向应力, 垂直応力, 수직응력
        """),
    )
}  # fmt: skip


@dataclass(frozen=True)
class CampaignColumn:
    """A column of tests.csv: its unit and text, and what its cells are.

    ``kind`` is name (text on one line), text, load, number, correction (of the numbers of an export), force (evaluated
    elsewhere), uncertainty (of such a force), count or zero. A number or count whose name is also a field of
    :class:`tribo.records.Test` gets there as it stands.
    """

    name: str
    kind: str
    unit: str
    text: str


CAMPAIGN_COLUMNS: dict[str, CampaignColumn] = {
    c.name: c
    for c in (
        CampaignColumn("test_id", "name", "", "name of the test; required"),
        CampaignColumn("file", "name", "", "path of its export in the campaign; required unless forces are given"),
        CampaignColumn("sample", "name", "", "name of a pattern of campaign.toml, or with x or y behind it; required"),
        CampaignColumn("mass_g", "load", "g", "mass put on the slider, without the slider itself"),
        CampaignColumn("normal_load_N", "load", "N", "normal load; used where a mass is given as well"),
        CampaignColumn("normal_stress_Pa", "load", "Pa", "load over the nominal area"),
        CampaignColumn("speed_mm_s", "number", "mm/s", "speed of the drive; pull_speed_mm_s of campaign.toml if empty"),
        CampaignColumn("hold_s", "number", "s", "time at rest under load before the pull"),
        CampaignColumn("temperature_C", "number", "°C", "temperature of the room or the contact"),
        CampaignColumn("humidity_pct", "number", "%", "relative humidity"),
        CampaignColumn("stiffness_N_per_m", "number", "N/m", "stiffness of the spring, wire or beam that pulls"),
        CampaignColumn("sign", "correction", "", "1 or -1; multiplies the friction force"),
        CampaignColumn("gain", "correction", "", "factor of the friction force, such as the ratio of two levers"),
        CampaignColumn("lever_arm_mm", "correction", "mm", "a torque is divided by it and becomes the friction force"),
        CampaignColumn("sampling_rate_Hz", "correction", "Hz", "gives the time of an export that has none"),
        CampaignColumn("static_N", "force", "N", "static friction force, evaluated elsewhere"),
        CampaignColumn("static_u_N", "uncertainty", "N", "its standard uncertainty"),
        CampaignColumn("sliding_N", "force", "N", "sliding friction force, evaluated elsewhere"),
        CampaignColumn("sliding_u_N", "uncertainty", "N", "its standard uncertainty"),
        CampaignColumn("static_mu", "force", "", "static friction coefficient, evaluated elsewhere"),
        CampaignColumn("static_mu_u", "uncertainty", "", "its standard uncertainty"),
        CampaignColumn("sliding_mu", "force", "", "sliding friction coefficient, evaluated elsewhere"),
        CampaignColumn("sliding_mu_u", "uncertainty", "", "its standard uncertainty"),
        CampaignColumn("coefficient", "force", "", "friction coefficient while sliding, evaluated elsewhere"),
        CampaignColumn("coefficient_u", "uncertainty", "", "its standard uncertainty"),
        CampaignColumn("repeat", "count", "", "number of the repeat"),
        CampaignColumn("run_order", "count", "", "place in the order in which the tests were made"),
        CampaignColumn("specimen_run", "count", "", "number of the pull on its specimen"),
        CampaignColumn("specimen", "name", "", "name of the specimen; that of the sample if empty"),
        CampaignColumn("direction", "name", "", "x or y, along which it was pulled"),
        CampaignColumn("started_at", "text", "", "date, or date and time, of the test"),
        CampaignColumn("operator", "name", "", "who made the test"),
        CampaignColumn("exclude", "text", "", "the reason, if the test is to be left out"),
        CampaignColumn("zero", "zero", "", "where the zero of the force comes from"),
        CampaignColumn("load_zero", "zero", "", "where the zero of the recorded load comes from"),
    )
}

# Spellings that pint does not know, or knows as something else.
_SPELLINGS = {
    "sec": "s",
    "secs": "s",
    "seconds": "s",
    "msec": "ms",
    "min": "minute",
    "h": "hour",
    "µs": "microsecond",
    "μs": "microsecond",
    "us": "microsecond",
    "n": "newton",
    "newtons": "newton",
    "millinewtons": "millinewton",
    "micron": "micrometer",
    "microns": "micrometer",
    "kn": "kilonewton",
    "mn": "millinewton",
    "cn": "centinewton",
    "un": "micronewton",
    "dan": "decanewton",
    "µn": "micronewton",
    "μn": "micronewton",
    "gf": "gram_force",
    "kgf": "kilogram_force",
    "kp": "kilogram_force",
    "lbf": "pound_force",
    "lb": "pound_force",
    "lbs": "pound_force",
    "ozf": "ounce_force",
    "kips": "kip",
    "mpa": "megapascal",
    "kpa": "kilopascal",
    "µm": "micrometer",
    "μm": "micrometer",
    "um": "micrometer",
    "in": "inch",
    '"': "inch",
    "%": "percent",
    "°c": "degC",
    "degc": "degC",
    "c": "degC",
    "°f": "degF",
    "f": "degF",
    "℃": "degC",
    "sek": "s",
    "sek.": "s",
    "seg": "s",
    "с": "s",
    "сек": "s",
    "秒": "s",
    "초": "s",
    "mm/sec": "mm/s",
    "мс": "ms",
    "毫秒": "ms",
    "мин": "minute",
    "н": "newton",
    "кн": "kilonewton",
    "мн": "millinewton",
    "牛": "newton",
    "牛顿": "newton",
    "千牛": "kilonewton",
    "毫牛": "millinewton",
    "кгс": "kilogram_force",
    "гс": "gram_force",
    "公斤": "kilogram_force",
    "мм": "millimeter",
    "мкм": "micrometer",
    "м": "meter",
    "ミリメートル": "millimeter",
    "ニュートン": "newton",
    "毫米": "millimeter",
    "微米": "micrometer",
    "米": "meter",
}
_CASE_MATTERS = {
    "mPa": "millipascal",
    "mN": "millinewton",
    "MN": "meganewton",
    "Mm": "megameter",
    "МН": "meganewton",
    "Мм": "megameter",
    "Nm": "newton * meter",
    "mNm": "millinewton * meter",
    "Ncm": "newton * centimeter",
    "Nmm": "newton * millimeter",
}
_TURNS = {
    "rps": "revolution/s", "rev/s": "revolution/s", "r/s": "revolution/s", "1/s": "revolution/s", "hz": "revolution/s",
    "rpm": "revolution/minute", "rev/min": "revolution/minute", "r/min": "revolution/minute",
    "1/min": "revolution/minute", "min-1": "revolution/minute", "u/min": "revolution/minute",
    "tr/min": "revolution/minute", "obr/min": "revolution/minute", "об/мин": "revolution/minute",
    "转/分": "revolution/minute", "转/分钟": "revolution/minute", "min^-1": "revolution/minute",
    "giri/min": "revolution/minute", "ot/min": "revolution/minute",
}  # fmt: skip
_MASSES_AS_FORCES = {"g": "gram_force", "kg": "kilogram_force"}
_NO_UNIT = {"", "-", "1", ".", "--", "none"}
_LONGEST_UNIT = 40
# A product of words and numbers with powers of one digit: nothing that could take long to work out.
_FACTOR = r"\(?[\d.]*\s*[^\W\d_]+[²³]?(?:\^-?\d)?\)?"
_UNIT_EXPRESSION = re.compile(rf"{_FACTOR}(?:\s*[/*· ]\s*{_FACTOR})*")
_NUMBER_BELOW = re.compile(r"/\s*([\d.]+\s*[^\W\d_]+)")


_LONGEST_NAME = 80  # characters; longer cells are no column names
_WIDE = str.maketrans("（）［］【】：／，　･・－", "()[][]:/, ··-")
_BARRED = str.maketrans({"ł": "l", "ø": "o", "đ": "d", "ß": "ss", "æ": "ae", "œ": "oe", "ı": "i"})
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
# what a logger writes before the name of a column: "C_1_Force", "Station 1 Force", "Latest: Force", "Run #2: Force"
_CHANNEL = re.compile(r"^\s*(?:(?:c|ch|channel|kanal|station)[ _]?\d+[ _]|(?:latest|run #?\d+)\s*:\s*)", re.I)


def narrow(text: str) -> str:
    """Brackets, blanks and marks of full width, as Chinese and Japanese programs write them, as ordinary ones."""
    return text if text.isascii() else text.translate(_WIDE)


def plain_name(text: str) -> str:
    """A column name without case, accents, units in brackets or punctuation: "Prüfzeit [s]" -> "prufzeit"."""
    text = re.sub(r"[\[(].*?[\])]", " ", narrow(text))
    text = _CHANNEL.sub("", text)
    text = unicodedata.normalize("NFKD", text).replace("μ", "mu ")
    text = "".join(c for c in text if not unicodedata.combining(c)).lower().translate(_BARRED)
    return re.sub(r"[^\w%]+|_+", " ", text).strip()


_RANKS: dict[str, tuple[str, int]] = {
    plain_name(alias): (q.name, rank) for q in QUANTITIES.values() for rank, alias in enumerate(q.aliases)
}


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=256)
def unit_factor(unit: str, quantity: str) -> tuple[float, float]:
    """(factor, offset) with SI value = factor * value + offset.

    A unit may be a product and carry a number: "30.7 gf", "N m / 2.5 mm".

    Raises
    ------
    ReadError
        The unit is unknown, empty, or not a unit of this quantity. Units are never guessed.
    """
    target = QUANTITIES[quantity].si_unit or "dimensionless"
    text = narrow(unit.strip())
    if not text and target != "dimensionless":
        raise ReadError(Problem("missing_unit", f"the {quantity} has no unit", allowed=f"a unit such as {target}"))
    _registry()  # an installation without a working pint is no fault of the unit
    try:
        zero, one = _in_unit(0.0, text, quantity, target), _in_unit(1.0, text, quantity, target)
    except Exception as why:  # pint raises many kinds, tokenizer errors among them
        raise ReadError(
            Problem("unknown_unit", f"not a unit of {quantity}", found=unit, allowed=f"a unit such as {target}")
        ) from why
    return one - zero, zero


def _in_unit(value: float, text: str, quantity: str, target: str) -> float:
    """``value`` times the unit ``text``, in ``target``."""
    if target == "dimensionless" and text in _NO_UNIT:
        return value
    if quantity == "rotation speed":
        text = _TURNS.get(text.lower(), text)
    ureg = _registry()
    if quantity == "torque":
        text = re.sub(r"(?<=[^\W\d_])[-.](?=[^\W\d_])", " ", text)  # N-m, in.lb
    name = _spelled_out(text, quantity)
    if re.fullmatch(r"\w+", name):
        return float(ureg.Quantity(value, name).to(target).magnitude)
    if len(text) > _LONGEST_UNIT or not _UNIT_EXPRESSION.fullmatch(text):
        raise ValueError(text)
    text = _NUMBER_BELOW.sub(r"/(\1)", text)
    expression = re.sub(r"[^\W\d_]+", lambda word: f"({_spelled_out(word[0], quantity)})", text)
    return float((value * ureg.parse_expression(expression)).to(target).magnitude)


def _spelled_out(word: str, quantity: str) -> str:
    """A unit in pint's spelling; g and kg are forces where a force is meant."""
    if ("force" in quantity or quantity == "torque") and word.lower() in _MASSES_AS_FORCES:
        return _MASSES_AS_FORCES[word.lower()]
    return _CASE_MATTERS.get(word) or _SPELLINGS.get(word.lower()) or word


@lru_cache(maxsize=1024)
def match_quantity(name: str) -> tuple[str, int] | None:
    """(quantity, rank of the alias) for a column name, or None where nothing fits."""
    if len(name) > _LONGEST_NAME:
        return None
    return _RANKS.get(plain_name(name)) or _RANKS.get(plain_name(_CAMEL.sub(" ", name)))


_SHORT_NAMES = {"force": "friction force", "friction": "friction force", "load": "normal force"}


def turns_a_time(unit: str) -> bool:
    """Whether a unit counts turns in a time: rpm, 1/s, obr/min."""
    return unit.strip().lower() in _TURNS


def quantity_named(key: str) -> str | None:
    """The quantity meant by a key such as "force", "normal_force", "time_s"; None where there is none."""
    plain = key.strip().replace("_", " ").lower()
    if plain in _SHORT_NAMES:
        return _SHORT_NAMES[plain]
    for q in QUANTITIES.values():
        if plain == q.name or key.strip() == q.column:
            return q.name
    return None
