# SPDX-License-Identifier: Apache-2.0
"""A C++ header of constants from an SVD file and a list of what is used."""
import os
import re
import tomllib

from .svd import Device, Refused

WORDS = {"svd", "namespace", "interrupts"}


def constant(name):
    """DIV_Mantissa -> kDivMantissa, PLLRDY -> kPllrdy."""
    return "k" + "".join(part.capitalize() for part in name.split("_"))


def read_list(path):
    try:
        with open(path, "rb") as file:
            wanted = tomllib.load(file)
    except tomllib.TOMLDecodeError as error:
        raise Refused(f"{path}: {error}") from None
    for word in sorted(WORDS):
        if word not in wanted:
            raise Refused(f"{path}: no '{word}'")
    return wanted


def series(device, peripheral, pattern):
    """The registers of a name, in order: one, or as many as a name with # stands for."""
    registers = device.registers(peripheral)
    if "#" not in pattern:
        if pattern not in registers:
            raise Refused(f"{device.path}: {peripheral} has no register {pattern}")
        return [registers[pattern]]
    expression = re.compile(re.escape(pattern).replace(r"\#", r"(\d+)"))
    found = sorted((int(match[1]), registers[name]) for name in registers if (match := expression.fullmatch(name)))
    if not found:
        raise Refused(f"{device.path}: {peripheral} has no register {pattern}")
    members = [one for _, one in found]
    strides = {b.offset - a.offset for a, b in zip(members, members[1:])}
    if len(strides) > 1:
        raise Refused(f"{device.path}: {peripheral}.{pattern}: the registers are not at one distance")
    return members


def resets(device, block, pattern):
    """Lines of the value after reset: one, or one of each peripheral where they differ."""
    values = {name: series(device, name, pattern)[0].reset for name in block["peripherals"]}
    if len(set(values.values())) == 1:
        return [f"inline constexpr std::uint32_t kResetValue = 0x{next(iter(values.values())):08X};"]
    return [f"inline constexpr std::uint32_t kResetValue{name.capitalize()} = 0x{value:08X};" for name, value in values.items()]


def register(device, block, pattern, fields):
    """Lines of one register or series."""
    first = block["peripherals"][0]
    members = series(device, first, pattern)
    lines = [f"/// {first}.{pattern}: {members[0].description}", f"namespace {pattern.replace('#', 'x').lower()} {{",
             f"inline constexpr std::uint32_t kOffset = 0x{members[0].offset:03X};"]
    if "#" in pattern:
        stride = members[1].offset - members[0].offset if len(members) > 1 else 0
        lines.append(f"inline constexpr std::uint32_t kStride = 0x{stride:02X}, kCount = {len(members)};")
    lines += resets(device, block, pattern)
    for name in fields.split():
        if name not in members[0].fields:
            raise Refused(f"{device.path}: {first}.{members[0].name} has no field {name}")
        lines.append("inline constexpr Field %s{%d, %d};" % (constant(name), *members[0].fields[name]))
    return lines + ["}"]


def header(wanted, device, list_name):
    lines = ["// SPDX-License-Identifier: Apache-2.0", "// clang-format off",
             f"// Generated from {os.path.basename(device.path)} by tools/run/generate_registers with {list_name}: not to be edited.",
             f"// {device.name} version {device.version}, sha256 {device.sha256}.",
             "// Names, offsets, bit positions and descriptions: Copyright (c) 2024 STMicroelectronics, Apache-2.0.",
             "#pragma once", "", '#include "hal/chip/support/register_field.hpp"', "", "#include <cstdint>", "",
             f"namespace {wanted['namespace']} {{", "", "/// Numbers of the interrupts in the NVIC.", "namespace interrupt {"]
    lines += [f"inline constexpr int {constant(name)} = {device.interrupt(name)};" for name in wanted["interrupts"]]
    lines.append("}  // namespace interrupt")
    for name, block in wanted.items():
        if name in WORDS:
            continue
        lines += ["", f"namespace {name} {{"]
        lines += [f"inline constexpr std::uint32_t {constant(one)} = 0x{device.base(one):08X};  ///< base address" for one in block["peripherals"]]
        for pattern, fields in block.items():
            if pattern != "peripherals":
                lines += register(device, block, pattern, fields)
        lines.append(f"}}  // namespace {name}")
    return "\n".join(lines + ["", f"}}  // namespace {wanted['namespace']}", ""])


def make(list_path, svd_folder):
    wanted = read_list(list_path)
    return header(wanted, Device(os.path.join(svd_folder, wanted["svd"])), os.path.basename(list_path))
