# SPDX-License-Identifier: Apache-2.0
"""A vendor's SVD file (CMSIS-SVD 1.1): peripherals, registers, fields, interrupts, with derivedFrom followed."""
import hashlib
import re
import xml.etree.ElementTree


class Refused(Exception):
    """A clear reason, with what and where."""


def number(text):
    return int(text, 0) if not re.fullmatch(r"0\d+", text) else int(text)


class Register:
    def __init__(self, element):
        self.name = element.findtext("name")
        self.offset = number(element.findtext("addressOffset"))
        self.reset = number(element.findtext("resetValue") or "0")
        self.description = " ".join((element.findtext("description") or "").split())
        self.fields = {one.findtext("name"): (number(one.findtext("bitOffset")), number(one.findtext("bitWidth")))
                       for one in element.iterfind("fields/field")}


class Device:
    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        self.path, self.sha256 = path, hashlib.sha256(data).hexdigest()
        try:
            root = xml.etree.ElementTree.fromstring(data)
        except xml.etree.ElementTree.ParseError as error:
            raise Refused(f"{path}: not XML: {error}") from None
        self.name, self.version = root.findtext("name"), root.findtext("version")
        self.peripherals = {one.findtext("name"): one for one in root.iterfind("peripherals/peripheral")}
        self.interrupts = {one.findtext("name"): number(one.findtext("value")) for one in root.iter("interrupt")}

    def peripheral(self, name):
        if name not in self.peripherals:
            raise Refused(f"{self.path}: no peripheral {name}")
        return self.peripherals[name]

    def base(self, name):
        return number(self.peripheral(name).findtext("baseAddress").lower())

    def registers(self, name):
        """Registers by name, with and without the peripheral's own in front (RCC_CR, CR). A derived peripheral has those of its origin, too."""
        element = self.peripheral(name)
        inherited = self.registers(element.get("derivedFrom")) if element.get("derivedFrom") else {}
        own = {one.findtext("name"): Register(one) for one in element.iterfind("registers/register")}
        return inherited | own | {full.removeprefix(name + "_"): one for full, one in own.items()}

    def interrupt(self, name):
        if name not in self.interrupts:
            raise Refused(f"{self.path}: no interrupt {name}")
        return self.interrupts[name]
