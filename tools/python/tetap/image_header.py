# SPDX-License-Identifier: Apache-2.0
"""The header of a flash image: 92 bytes, 512 bytes behind the image's begin. Little-endian: "tetapIMG", CRC-32, commit (28 bits, then 4: 1 where the tree
differed), layout (1), length, address, board and robot (32 bytes each, with zeros behind). The CRC-32 (zlib's) is over the whole image, its own four bytes
taken as 0xFFFFFFFF. sim_host/control/image_header.hpp reads the same."""
import os
import re
import struct
import zlib

OFFSET, MAGIC, LAYOUT, UNFILLED = 0x200, b"tetapIMG", 1, 0xFFFFFFFF
FORM = struct.Struct("<8sIIIII32s32s")
CRC_AT = OFFSET + 8
NAME = re.compile(rb"([a-z0-9_]{1,31})\0+")
COMMIT = re.compile(rb"tetap-git:\0\0(.{4})", re.S)  # toolchain/version.cmake


class Refused(Exception):
    """One line: what is wrong with an image."""


class Header:
    def __init__(self, crc, commit, length, address, board, robot):
        self.crc, self.commit, self.length, self.address, self.board, self.robot = crc, commit, length, address, board, robot

    def version(self):
        return f"{self.commit >> 4:07x}{'-dirty' if self.commit & 15 else ''}"

    def packed(self):
        return FORM.pack(MAGIC, self.crc, self.commit, LAYOUT, self.length, self.address, self.board.encode(), self.robot.encode())


def crc_of(image):
    return zlib.crc32(image[CRC_AT + 4:], zlib.crc32(b"\xff" * 4, zlib.crc32(image[:CRC_AT])))


def flattened(elf):
    """(address, bytes) of what an ELF file stores, as objcopy -O binary writes it; Refused where it is cut."""
    try:
        if struct.unpack_from("<H", elf, 18)[0] != 40:
            raise Refused("not an ELF file for ARM")
        start, = struct.unpack_from("<I", elf, 28)
        size, count = struct.unpack_from("<HH", elf, 42)
        segments = [struct.unpack_from("<8I", elf, start + i * size) for i in range(count)]
    except struct.error:
        raise Refused("the ELF file is cut in its headers") from None
    segments = [(where, offset, stored) for kind, offset, _, where, stored, *_ in segments if kind == 1 and stored]
    if not segments:
        raise Refused("the ELF file stores nothing")
    first, end = min(s[0] for s in segments), max(s[0] + s[2] for s in segments)
    if end - first > 1 << 26:
        raise Refused("the ELF file stores more than 64 MB")
    image = bytearray(end - first)
    for where, offset, stored in segments:
        if offset + stored > len(elf):
            raise Refused(f"the ELF file is cut: {len(elf)} bytes of at least {offset + stored}")
        image[where - first:where - first + stored] = elf[offset:offset + stored]
    return first, bytes(image)


def image_in(file):
    """(address or None, image) of a .bin or .elf file's bytes."""
    return flattened(file) if file[:4] == b"\x7fELF" else (None, file)


def read(file):
    """The header of a whole image, .bin or .elf; Refused otherwise."""
    address, image = image_in(file)
    if image[OFFSET:OFFSET + 8] != MAGIC:
        raise Refused(f"{len(image)} bytes without an image header: cut, or no image of this project")
    if len(image) < OFFSET + FORM.size:
        raise Refused(f"cut inside the image header: {len(image)} bytes")
    _, crc, commit, layout, length, linked, board, robot = FORM.unpack_from(image, OFFSET)
    if layout == UNFILLED:
        raise Refused("its image header was never filled: link it again")
    if layout != LAYOUT:
        raise Refused(f"image header of layout {layout}, known is {LAYOUT}")
    if length != len(image):
        raise Refused(f"{len(image)} bytes, its header says {length}: cut or joined")
    if crc != crc_of(image):
        raise Refused(f"damaged: CRC-32 {crc_of(image):#010x}, its header says {crc:#010x}")
    names = [NAME.fullmatch(name) for name in (board, robot)]
    if None in names or (address is not None and address != linked):
        raise Refused("its header names no board, robot or address")
    return Header(crc, commit, length, linked, *(name[1].decode() for name in names))


def seal(elf_path, bin_path, board, robot):
    """Fills the header of a linked image in both files. False: its linker script keeps no room for one."""
    with open(elf_path, "rb") as file:
        elf = bytearray(file.read())
    with open(bin_path, "rb") as file:
        image = bytearray(file.read())
    address, stored = flattened(elf)
    if stored != image:
        raise Refused(f"{os.path.basename(bin_path)} is not what {os.path.basename(elf_path)} stores")
    if image[OFFSET:OFFSET + 8] != MAGIC:
        return False
    commits = {found[1] for found in COMMIT.finditer(image)}
    if len(commits) != 1:
        raise Refused(f"{os.path.basename(elf_path)} names {len(commits)} commits")
    if not all(NAME.fullmatch(name.encode() + b"\0") for name in (board, robot)):
        raise Refused(f"board '{board}', robot '{robot}': names have at most 31 of a-z, 0-9 and _")
    header = Header(0, int.from_bytes(commits.pop(), "little"), len(image), address, board, robot)
    image[OFFSET:OFFSET + FORM.size] = header.packed()
    header.crc = crc_of(image)
    image[OFFSET:OFFSET + FORM.size] = header.packed()
    at = [found.start() for found in re.finditer(re.escape(MAGIC), elf)]
    if len(at) != 1:
        raise Refused(f"{os.path.basename(elf_path)} has {len(at)} image headers")
    elf[at[0]:at[0] + FORM.size] = header.packed()
    for path, content in ((elf_path, elf), (bin_path, image)):
        with open(path, "r+b") as file:
            file.write(content)
    read(bytes(elf))
    return True
