"""Writes stm32g474_registers.csv: where the registers and fields lie that the port uses.

    python tests/firmware/stm32g474_registers.py CRATE

CRATE is the folder `stm32g4-0.16.0` of the crate of that name and version, which is generated from
the maker's own description of the device (STM32G474.svd).
"""

import csv
import re
import sys
from pathlib import Path

NOTICE = """\
# Addresses, bits and widths of the STM32G474's registers that the port uses.
# Extracted by stm32g474_registers.py from the crate stm32g4 0.16.0 (stm32-rs, MIT or Apache-2.0).
# The crate is generated from STM32G474.svd, Copyright (c) STMicroelectronics, licensed under the
# Apache License, Version 2.0 (http://www.apache.org/licenses/LICENSE-2.0), distributed without
# warranties or conditions of any kind. Changes: names in upper case, only what the port uses.
"""

OUTPUT = "POL1 IDLEM1 IDLES1 FAULT1 CHP1 POL2 IDLEM2 IDLES2 FAULT2 CHP2 DTEN"
EDGES = "CMP1 CMP2 CMP3 CMP4 MSTCMP1"
TIMER = {
    "CR": "CKPSC CONT HALF TRSTU PREEN",
    "PERR": "PER",
    **{f"CMP{n}R": "CMP" for n in (1, 2, 3, 4)},
    **{f"{kind}{n}R": EDGES for kind in ("SET", "RST") for n in (1, 2)},
    "RSTR": "",
    "DTR": "",
    "OUTR": OUTPUT,
    "FLTR": "FLT1EN",
}
CONVERTER = {
    "ISR": "ADRDY JEOS",
    "IER": "JEOSIE",
    "CR": "ADEN JADSTART ADVREGEN DEEPPWD ADCAL",
    "CFGR": "RES ALIGN JQDIS",
    "SMPR1": "SMP1 SMP2 SMP3",
    "JSQR": "JL JEXTSEL JEXTEN JSQ1 JSQ2",
    "JDR1": "JDATA",
    "JDR2": "JDATA",
}


def numbered(name: str, numbers: range) -> str:
    return " ".join(f"{name}{n}" for n in numbers)


PINS = {
    "MODER": numbered("MODER", range(16)),
    "BSRR": f"{numbered('BS', range(3))} {numbered('BR', range(3))}",
    "AFRL": numbered("AFRL", range(8)),
    "AFRH": numbered("AFRH", range(8, 16)),
}
USED = {
    "RCC": {
        "CR": "HSEON HSERDY PLLON PLLRDY",
        "CFGR": "SW SWS HPRE",
        "PLLCFGR": "PLLSRC PLLM PLLN PLLREN PLLR",
        "AHB2ENR": "GPIOAEN GPIOBEN GPIOCEN ADC12EN ADC345EN",
        "APB1ENR1": "TIM3EN PWREN",
        "APB2ENR": "HRTIM1EN",
    },
    "PWR": {"CR5": "R1MODE"},
    "FLASH": {"ACR": "LATENCY PRFTEN ICEN DCEN"},
    "GPIOA": PINS,
    "GPIOB": PINS,
    "GPIOC": PINS,
    "ADC1": CONVERTER,
    "ADC2": CONVERTER,
    "ADC3": CONVERTER,
    "ADC12_COMMON": {"CCR": "CKMODE"},
    "ADC345_COMMON": {"CCR": "CKMODE"},
    "HRTIM_MASTER": {
        "CR": "CKPSC CONT HALF MCEN TACEN TBCEN TCCEN PREEN",
        "ISR": "REP",
        "ICR": "REPC",
        "PERR": "PER",
        "CMP1R": "CMP",
    },
    "HRTIM_TIMA": TIMER,
    "HRTIM_TIMB": TIMER,
    "HRTIM_TIMC": TIMER,
    "HRTIM_COMMON": {
        "CR1": "MUDIS TAUDIS TBUDIS TCUDIS",
        "CR2": "MSWU TASWU TBSWU TCSWU MRST TARST TBRST TCRST",
        "ISR": "FLT1",
        "ICR": "FLT1C",
        "OENR": "TA1OEN TA2OEN TB1OEN TB2OEN TC1OEN TC2OEN",
        "ODISR": "TA1ODIS TA2ODIS TB1ODIS TB2ODIS TC1ODIS TC2ODIS",
        "ADC2R": "MPER",
        "FLTINR1": "FLT1E FLT1P FLT1SRC FLT1F",
    },
    "TIM3": {"CR1": "CEN", "SMCR": "SMS", "CCMR1_INPUT": "CC1S CC2S", "CNT": "", "ARR": ""},
    "IWDG": {"KR": "KEY", "PR": "PR", "RLR": "RL", "SR": "PVU RVU WVU"},
}


def fields(text: str) -> dict[str, tuple[int, int]]:
    """(bit, width) of each field of a register's source."""
    found = {}
    lines = re.compile(r"///Bits? (\d+)(?::(\d+)) -|///Bit (\d+) -", re.M)
    for place in lines.finditer(text):
        name = re.search(r"pub fn (\w+)\(", text[place.end() :])
        first, last, single = place.groups()
        low, high = (int(single), int(single)) if single else (int(first), int(last))
        if name:
            found[name.group(1).upper()] = (low, high - low + 1)
    return found


def source(device: Path, module: str, register: str) -> str:
    """A register's source; registers that are alike have one."""
    reused = re.search(
        rf"pub use (?:crate::stm32g474::(\w+)::)?(?:{register}|(\w+) as {register});",
        (device / f"{module}.rs").read_text(),
    )
    if reused:
        return source(device, reused.group(1) or module, reused.group(2) or register)
    return (device / module / f"{register}.rs").read_text()


def rows(crate: Path) -> list[list[str]]:
    device = crate / "src" / "stm32g474"
    listed = (device / "mod.rs").read_text()
    made = []
    for peripheral, registers in USED.items():
        place = re.search(
            rf"pub type {peripheral} = crate::Periph<(\w+)::RegisterBlock, (0x[\w]+)>", listed
        )
        if place is None:
            raise SystemExit(f"error: no {peripheral} in {device}")
        module, base = place.group(1), int(place.group(2).replace("_", ""), 16)
        block = (device / f"{module}.rs").read_text()
        for register, names in registers.items():
            at = re.search(
                rf"///(0x[0-9a-f]+) - [^\n]*\n(?:    #\[[^\n]*\n)*    pub const fn "
                rf"{register.lower()}\(&self\) -> &(\w+)",
                block,
            )
            if at is None:
                raise SystemExit(f"error: no {peripheral}.{register} in {device}")
            address = f"0x{base + int(at.group(1), 16):08X}"
            within = fields(source(device, module, at.group(2).lower()))
            made.append([f"{peripheral}.{register}", address, "", "", ""])
            for name in names.split():
                if name not in within:
                    raise SystemExit(f"error: {register} has no {name}, it has {' '.join(within)}")
                bit, width = within[name]
                made.append([f"{peripheral}.{register}", address, name, str(bit), str(width)])
    interrupt = re.search(r"///(\d+) - ADC1_2\n", listed) or re.search(r"ADC1_2 = (\d+)", listed)
    if interrupt is None:
        raise SystemExit(f"error: no interrupt ADC1_2 in {device}")
    made.append(["interrupt ADC1_2", "", "", interrupt.group(1), ""])
    return made


def main() -> None:
    out = Path(__file__).with_suffix(".csv")
    with out.open("w", newline="") as file:
        file.write(NOTICE)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["register", "address", "field", "bit", "width"])
        writer.writerows(rows(Path(sys.argv[1])))


if __name__ == "__main__":
    main()
