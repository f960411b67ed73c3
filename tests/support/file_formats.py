"""Every format that the package reads: its reader, and valid files of it for a fuzzer to begin
with."""

import io
import json
import tempfile
import warnings
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path

import numpy as np
import scipy.io

import reluctance as rl
from reluctance.drive.course import read_course
from reluctance.drive.laws.angle_table import read_angle_table
from reluctance.explore.efficiency_map.cycle import read_cycle
from reluctance.explore.sweeps.store import Row, Store
from reluctance.machine.geometry.geometry_machine import geometry_of
from reluctance.machine.geometry.steel_file import read_curve
from reluctance.machine.held_pulses import read_held_pulses
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.maps.check import check_map
from reluctance.machine.maps.importers import read_map
from reluctance.machine.maps.pole_force import read_pole_force
from reluctance.machine.maps.pulses import read_pulses
from reluctance.machine.pair_file import read_pairs
from reluctance.plant.hydraulics.curve_file import curve_from
from reluctance.pumping.site import Site
from reluctance.pumping.system import load_system
from reluctance.pumping.weather_file import WeatherTable, read_weather
from reluctance.targets.export.dump import (
    API,
    HEADER,
    MAGIC,
    NO_SAMPLE,
    VERSION,
    read_dump,
    record_type,
)

ROOT = Path(__file__).parents[2]
SITE = Site(latitude_deg=36.1, longitude_deg=-79.95, timezone="Etc/GMT+5")
KEY = bytes(16)


@dataclass(frozen=True)
class Format:
    """A kind of file."""

    suffix: str
    read: Callable[[Path], object]
    seeds: Callable[[], list[bytes]]
    wrap: Callable[[bytes], bytes] = bytes  # what is changed becomes a file, with a CRC or packed
    finite: bool = True  # every number of what is read
    taken: bool = True  # the seeds; a year or the tables of a machine would be long


def files(*patterns: str) -> Callable[[], list[bytes]]:
    return lambda: [p.read_bytes() for pattern in patterns for p in sorted(ROOT.glob(pattern))]


def lines(*texts: str) -> Callable[[], list[bytes]]:
    return lambda: [text.encode() for text in texts]


def weather(kind: str) -> Callable[[Path], object]:
    return lambda path: read_weather(WeatherTable(kind=kind, file=str(path)), SITE, path.parent)


def checked_map(path: Path) -> object:
    return check_map(read_map(path, N_r=4))


def machine(path: Path) -> object:
    return machine_from(machine_table(path.name, path.parent))


def geometry(path: Path) -> object:
    """Without the field: a machine may ask for long computations."""
    found = geometry_of(machine_table(path.name, path.parent), "[machine]")
    return found, found.cross_section, found.coils


def pairs(path: Path) -> object:
    return read_pairs(path, N_r=4, n_phases=3)


def beside(folder: Path) -> None:
    """What the seeds name lies in a folder."""
    for of in ("examples", "machines"):
        for file in (ROOT / of).iterdir():
            (folder / file.name).symlink_to(file)


GRID = {
    "i_A": [0.0, 10.0, 20.0, 30.0],
    "theta_e_deg": [0.0, 60.0, 120.0, 180.0],
    "psi_Wb": [[0, 0, 0, 0], [0.1, 0.2, 0.4, 0.5], [0.2, 0.4, 0.7, 0.8], [0.3, 0.6, 0.9, 1.0]],
    "N_r": 4,
}
MAP = "\n".join(
    ["i_A,theta_e_deg,psi_Wb"]
    + [
        f"{i},{angle},{psi}"
        for i, row in zip(GRID["i_A"], GRID["psi_Wb"], strict=True)
        for angle, psi in zip(GRID["theta_e_deg"], row, strict=True)
    ]
)


def mats() -> list[bytes]:
    found = []
    for compressed in (False, True):
        file = io.BytesIO()
        scipy.io.savemat(file, GRID | {"note": "x"}, do_compression=compressed)
        found.append(file.getvalue())
    return found


def workbook() -> tuple[bytes, bytes]:
    """A spreadsheet, and the text of its sheet."""
    import openpyxl

    book, file = openpyxl.Workbook(), io.BytesIO()
    for row in MAP.split("\n"):
        book.active.append([float(x) if x[0].isdigit() else x for x in row.split(",")])
    book.save(file)
    with zipfile.ZipFile(file) as made:
        return file.getvalue(), made.read("xl/worksheets/sheet1.xml")


def with_sheet(text: bytes) -> bytes:
    whole, file = io.BytesIO(workbook()[0]), io.BytesIO()
    with zipfile.ZipFile(whole) as given, zipfile.ZipFile(file, "w") as made:
        for name in given.namelist():
            made.writestr(name, text if name.endswith("sheet1.xml") else given.read(name))
    return file.getvalue()


def dumps() -> list[bytes]:
    head, record = np.zeros(1, HEADER), record_type(3)
    for name, value in dict(
        magic=MAGIC, version=VERSION, api=API, phases=3, state_words=4,
        record_words=record.itemsize // 4, segments=2, trigger=NO_SAMPLE, phase=-1,
    ).items():  # fmt: skip
        head[name] = value
    segment = np.array([0, 3], "<u4").tobytes() + bytes(16) + np.zeros(3, record).tobytes()
    return [head.tobytes() + 2 * segment]


def with_crc(data: bytes) -> bytes:
    return data + zlib.crc32(data).to_bytes(4, "little")


def stores() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.sqlite"
        store = Store(path)
        store.add([Row(KEY, {"a": 1}, dict.fromkeys(rl.Kpis.border_names(), 0.5))])
        store.close()
        return [path.read_bytes()]


def read_store(path: Path) -> object:
    store = Store(path)
    try:
        (KEY in store, list(store.known([KEY])))
    finally:
        store.close()
    return None


HOURS = [f"2025-06-21 {h:02}:00" for h in range(24)]
CSV_WEATHER = "time,ghi,dni,dhi,temp_air,wind_speed\n" + "\n".join(f"{h},9,5,4,20,1" for h in HOURS)
PVGIS = (
    "Latitude (decimal degrees): 36.1\nLongitude (decimal degrees): -79.95\nElevation (m): 100\n"
    "{head}\n{names}\n{rows}\n\nT2m: air\n"
)
STAMPS = [f"20190621:{h:02}10" for h in range(24)]
TMY = PVGIS.format(
    head="",
    names="time(UTC),T2m,RH,G(h),Gb(n),Gd(h),IR(h),WS10m,WD10m,SP",
    rows="\n".join(f"{s},28,30,9,5,4,300,2,0,980" for s in STAMPS),
)
HOURLY = PVGIS.format(
    head="Slope: 0 deg.\nAzimuth: 0 deg.\n",
    names="time,Gb(i),Gd(i),Gr(i),H_sun,T2m,WS10m,Int",
    rows="\n".join(f"{s},5,4,0,0,28,2,0" for s in STAMPS),
)
EPW = "\n".join(
    ["LOCATION,x,x,USA,TMY3,1,36.1,-79.95,-5.0,273.0", *["x"] * 7]
    + [
        f"2025,6,21,{h},0,x,20,10,50,98000,0,0,300,9,5,4,0,0,0,0,180,1,5,5,10,7,9,0,0,0,0,0,0,0,0"
        for h in range(1, 25)
    ]
)


def tmy3() -> list[bytes]:
    import pvlib

    whole = (Path(pvlib.__file__).parent / "data" / "723170TYA.CSV").read_bytes()
    return [b"\n".join(whole.split(b"\n")[:25])]


STEEL = "H_A_per_m,B_T\n" + "\n".join(
    f"{h},{b}" for h, b in ((0, 0), (50, 0.5), (100, 1.0), (500, 1.4), (5000, 1.7), (30000, 2.0))
)
PUMP = "Q_m3ph,H_m,eta\n0,30,0\n10,29,0.3\n20,28,0.5\n"
COURSE = "t_s,tau_Nm\n0,1\n0.5,2\n1,1\n"
CYCLE = "t_s,speed_rpm,tau_Nm\n0,100,1\n1,200,2\n2,300,1\n"
PULSE = "t_s,u_V,i_A,theta_m_deg\n" + "\n".join(
    f"{k * 1e-4:g},{100 if 20 <= k < 40 else 0},{max(0, k - 20) if k < 40 else 0},0"
    for k in range(80)
)
HELD = "t_s,i_A,theta_m_deg,u_held_mean_V,i_held_A,pair\n" + "\n".join(
    f"{k * 1e-4:g},{max(0, k - 20) if k < 40 else 0},0,5,3,ab" for k in range(60)
)
PAIRS = "pair,phi_deg,i_first_A,i_second_A,energy_J,tau_Nm,psi_first_Wb,psi_second_Wb\n"


def json_maps() -> list[bytes]:
    return [json.dumps(GRID).encode()]


FORMATS = {
    "drive": Format(
        ".toml", rl.load, files("examples/[a-m]*.toml", "examples/p*.toml"), finite=False
    ),
    "machine": Format(".toml", machine, files("machines/*.toml"), finite=False),
    "geometry": Format(".toml", geometry, files("machines/geometry/*.toml"), finite=False),
    "system": Format(".toml", load_system, files("examples/sun_[dvy]*.toml"), finite=False),
    "map_csv": Format(".csv", checked_map, lines(MAP, MAP.replace(",", ";"))),
    "map_json": Format(".json", checked_map, json_maps),
    "mat": Format(".mat", lambda path: check_map(read_map(path)), mats),
    "map_xlsx": Format(".xlsx", checked_map, lambda: [workbook()[1]], wrap=with_sheet),
    "map_packed": Format(".xlsx", checked_map, lambda: [workbook()[0]]),
    "force": Format(".csv", read_pole_force, files("machines/emdlab_8_6_force.csv")),
    "pairs": Format(
        ".csv", lambda path: read_pairs(path, N_r=4, n_phases=3), lines(PAIRS), taken=False
    ),
    "steel": Format(".csv", read_curve, lines(STEEL)),
    "pump": Format(".csv", lambda path: curve_from(path, 150.0), lines(PUMP)),
    "angles": Format(".csv", read_angle_table, files("examples/angle_table.csv")),
    "course": Format(".csv", lambda path: read_course(path, "tau_Nm"), lines(COURSE)),
    "cycle": Format(".csv", read_cycle, lines(CYCLE)),
    "pulses": Format(".csv", lambda path: read_pulses([path]), lines(PULSE)),
    "held_pulses": Format(".csv", lambda path: read_held_pulses([path], n_phases=3), lines(HELD)),
    "weather_csv": Format(".csv", weather("csv"), lines(CSV_WEATHER)),
    "weather_epw": Format(".epw", weather("epw"), lines(EPW)),
    "weather_tmy3": Format(".csv", weather("tmy3"), tmy3, taken=False),
    "weather_pvgis": Format(".csv", weather("pvgis"), lines(TMY, HOURLY)),
    "dump": Format(".dump", read_dump, dumps, wrap=with_crc, finite=False),
    "store": Format(".sqlite", read_store, stores),
}


def format_of(folder: str) -> Format:
    """The format that the name of a folder of tests/fuzz begins with."""
    return FORMATS[max((n for n in FORMATS if folder.startswith(f"{n}_")), key=len)]


def finite(value: object, depth: int = 4) -> bool:
    """Whether the numbers of what was read are finite."""
    if isinstance(value, float | np.ndarray):
        kind = np.asarray(value).dtype.kind
        return kind != "f" or bool(np.isfinite(value).all())
    if depth and is_dataclass(value):
        return all(finite(getattr(value, f.name), depth - 1) for f in fields(value))
    if depth and isinstance(value, list | tuple):
        return all(finite(item, depth - 1) for item in value[:1000])
    return True


def read_quietly(form: Format, path: Path) -> object:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pandas, about what it makes of a damaged file
        return form.read(path)
