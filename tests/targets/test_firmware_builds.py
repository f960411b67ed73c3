"""The exported package compiles for other processors and compilers, and two link into one image."""

import ctypes
import os
import re
import subprocess

import pytest
from firmware_tools import drive, needs_target
from needs import needs

import reluctance as rl
from reluctance.base import toolchain
from reluctance.targets.export import firmware

needs_clang = needs("clang++")


def build(folder, *arguments):
    done = subprocess.run(
        ["make", "-s", "all", *arguments], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return firmware(drive("edge_mpc_late"), tmp_path_factory.mktemp("builds") / "package").folder


CPUS = ["cortex-m4", "cortex-m7", "cortex-m33", "cortex-m55", "cortex-r5"]


@needs_target
@pytest.mark.parametrize("cpu", CPUS)
def test_it_compiles_for_every_processor_that_the_makefile_names(package, cpu):
    build(package, f"CPU={cpu}")


@needs("make", "arm-none-eabi-g++")
def test_a_processor_that_the_makefile_does_not_know_is_one_line_that_names_those_it_knows(package):
    command = ["make", "-s", "CPU=cortex-m9"]
    done = subprocess.run(command, cwd=package, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    named = re.search(r"CPU=cortex-m9, need one of: ([^;]*);.* TARGET", done.stderr)
    assert named is not None and sorted(named[1].split()) == sorted(CPUS)


def headers_of_the_cross_compiler():
    """Include folders of arm-none-eabi-g++: its headers serve other 32-bit targets too."""
    told = subprocess.run(
        ["arm-none-eabi-g++", "-E", "-v", "-x", "c++", os.devnull], capture_output=True, text=True
    ).stderr
    listed = told.partition("#include <...>")[2].partition("End of search")[0].splitlines()[1:]
    return " ".join(f"-isystem {line.strip()}" for line in listed)


CLANG = {
    "desk": "",
    "cortex-m7": "--target=arm-none-eabi -mcpu=cortex-m7 -mthumb -mfpu=fpv5-sp-d16 "
    "-mfloat-abi=hard",
    "risc-v": "--target=riscv32-unknown-elf -march=rv32imafc -mabi=ilp32f",
}


@needs_target
@needs_clang
@pytest.mark.parametrize("target", CLANG)
def test_it_compiles_with_clang(package, target):
    flags = CLANG[target]
    if flags:
        flags += " " + headers_of_the_cross_compiler()
    build(package, "CC=clang", "CXX=clang++", f"OUT=build/clang-{target}", f"TARGET={flags}")


def test_two_drives_link_into_one_image_and_answer_for_themselves(tmp_path):
    drives = {"left": "sharing", "for": "deadbeat"}  # a word of the language names none of them
    made = {p: firmware(drive(n), tmp_path / p, prefix=p) for p, n in drives.items()}
    objects = []
    for side, one in made.items():
        for source in ("controller", "peripherals"):
            out = tmp_path / f"{side}_{source}.o"
            flags = ["-std=c++20", "-O1", "-fPIC", "-I.", "-Iinclude", "-c", f"{source}.cpp"]
            subprocess.run(["g++", *flags, "-o", str(out)], cwd=one.folder, check=True)
            objects.append(str(out))
        text = "".join(p.read_text() for p in one.folder.rglob("*.*") if p.is_file())
        assert "reluctance_" not in text and "RELUCTANCE_" not in text
    image = tmp_path / "both.so"
    subprocess.run(["g++", "-shared", *objects, "-o", str(image)], check=True)
    library = ctypes.CDLL(str(image))
    for side, one in made.items():
        fingerprint = getattr(library, f"{side}_fingerprint")
        fingerprint.restype = ctypes.c_uint32
        assert fingerprint() == one.fingerprint
    assert made["left"].fingerprint != made["for"].fingerprint


def test_two_packages_in_one_process_keep_their_own_constants(tmp_path):
    """A constant that the linker shares by name would give both the values of the one loaded first.
    Both stay loaded: their functions have the same names."""
    loaded = []
    for limit in (200.0, 150.0):
        one = drive("sharing").with_values({"machine.i_max_A": limit})
        folder = firmware(one, tmp_path / f"{limit:.0f}").folder
        flags = ["-O1", "-I.", "-Iinclude"]
        sources = ["controller.cpp", "run_time.cpp", "peripherals.cpp"]
        toolchain.build(sources, "image.so", flags, folder=folder, what="the package")
        symbols = subprocess.run(
            ["nm", "-DC", "--defined-only", "image.so"],
            cwd=folder,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        assert not re.search(r" [uV] reluctance::", symbols)
        loaded.append(ctypes.CDLL(str(folder / "image.so")))
    built = []
    for library in loaded:
        library.reluctance_parameter_get.restype = ctypes.c_float
        controller = ctypes.create_string_buffer(8192)
        library.reluctance_init(controller)
        number = library.reluctance_parameter_find(b"current_trip")
        assert number >= 0
        built.append(library.reluctance_parameter_get(controller, number))
    assert built[0] != built[1]


@pytest.mark.parametrize("prefix", ["", "Left", "1st", "a-b", "x" * 32])
def test_a_prefix_that_is_no_name_is_refused(prefix, tmp_path):
    with pytest.raises(rl.ParameterError, match="need a lower-case C name"):
        firmware(drive("sharing"), tmp_path / "package", prefix=prefix)


@pytest.mark.parametrize("prefix", ["board", "control"])
def test_a_prefix_that_would_give_two_things_one_name_is_refused(prefix, tmp_path):
    with pytest.raises(rl.ParameterError, match=f"has a name `{prefix}_.*` of its own"):
        firmware(drive("sharing"), tmp_path / "package", prefix=prefix)
    assert not (tmp_path / "package").exists()


@pytest.mark.parametrize(
    "name", ["controller", "commission", "peripherals", "recorder", "run_time"]
)
def test_an_old_standard_of_the_language_is_one_error_that_names_it(name, package):
    done = subprocess.run(
        ["g++", "-std=gnu++17", "-I.", "-Iinclude", "-c", f"{name}.cpp", "-o", "/dev/null"],
        cwd=package,
        capture_output=True,
        text=True,
        check=False,
    )
    first = done.stderr.splitlines()
    assert done.returncode != 0 and len(first) < 20
    assert any("needs C++20" in line for line in first), done.stderr
