"""A CSV log as frames on a CAN bus: the database, a candump trace and an MDF 4 file, written from the formats' definitions."""

import csv
import struct

# One message a pair of columns: the first an integer with a factor and Motorola's byte order, the second a real of 32 bits.
FACTOR = 2.0**-20
FIRST_ID = 0x100


def rows_of(path):
    with open(path, newline="") as file:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]


def names_of(rows):
    return [name for name in rows[0] if name != "t_s"]


def pairs_of(names):
    return [names[i : i + 2] for i in range(0, len(names), 2)]


def database(names):
    lines, reals = ['VERSION "1"', "BU_: ECU"], []
    for k, pair in enumerate(pairs_of(names)):
        lines.append(f"BO_ {FIRST_ID + k} M{k}: 8 ECU")
        # The start bit of a big-endian signal is its most significant one: bit 7 of the first byte.
        lines.append(f' SG_ s{2 * k} : 7|32@0- ({FACTOR!r},0) [0|0] "" ECU')
        if len(pair) > 1:
            lines.append(f' SG_ s{2 * k + 1} : 32|32@1- (1,0) [0|0] "" ECU')
            reals.append(f"SIG_VALTYPE_ {FIRST_ID + k} s{2 * k + 1} : 1;")
    return "\n".join(lines + reals) + "\n"


def mapping(names, dbc):
    return f"dbc: {dbc}\ncolumns:\n" + "".join(f'  {name}: "s{i}"\n' for i, name in enumerate(names))


def frames(rows):
    """(time, identifier, data) of each message of each row."""
    names = names_of(rows)
    for row in rows:
        for k, pair in enumerate(pairs_of(names)):
            data = struct.pack(">i", round(row[pair[0]] / FACTOR))
            data += struct.pack("<f", row[pair[1]]) if len(pair) > 1 else bytes(4)
            yield row["t_s"], FIRST_ID + k, data


def candump(rows, start=1000.0):
    return "".join(f"({start + t:.6f}) can0 {i:03X}#{data.hex().upper()}\n" for t, i, data in frames(rows))


class Mdf:
    """Blocks of an MDF 4.10 file one after another; a link is the place of a block written before."""

    def __init__(self):
        self.file = bytearray(b"MDF     4.10    test    " + struct.pack("<IH", 0, 410) + bytes(34))
        self.file += b"##HD" + struct.pack("<IQQ", 0, 104, 6) + bytes(80)

    def block(self, name, links, data):
        self.file += bytes(-len(self.file) % 8)
        at = len(self.file)
        self.file += b"##" + name + struct.pack("<IQQ", 0, 24 + 8 * len(links) + len(data), len(links))
        self.file += struct.pack(f"<{len(links)}Q", *links) + data
        return at


def mdf(rows):
    """A bus logger's file: records of time, identifier, flags and a place in the signal data that holds the frames' bytes."""
    w, records, signal = Mdf(), bytearray(), bytearray()
    count = 0
    for t, identifier, data in frames(rows):
        records += struct.pack("<dIBQ", t, identifier, len(data) << 1, len(signal))
        signal += struct.pack("<I", len(data)) + data
        count += 1
    kept, stored = w.block(b"SD", [], bytes(signal)), w.block(b"DT", [], bytes(records))
    following = 0
    # name, type, sync, data type, bit, byte, bits, link to signal data
    for name, *numbers, link in reversed([
        ("Timestamp", 2, 1, 4, 0, 0, 64, 0), ("CAN_DataFrame.ID", 0, 0, 0, 0, 8, 29, 0),
        ("CAN_DataFrame.IDE", 0, 0, 0, 0, 12, 1, 0), ("CAN_DataFrame.DataLength", 0, 0, 0, 1, 12, 7, 0),
        ("CAN_DataFrame.DataBytes", 1, 0, 10, 0, 13, 64, kept)]):
        text = w.block(b"TX", [], name.encode() + b"\0")
        following = w.block(b"CN", [following, 0, text, 0, 0, link, 0, 0], struct.pack("<4BII", *numbers) + bytes(60))
    group = w.block(b"CG", [0, following, 0, 0, 0, 0], struct.pack("<QQQII", 0, count, 0, 21, 0))
    data_group = w.block(b"DG", [0, group, stored, 0], bytes(8))
    w.file[88:96] = struct.pack("<Q", data_group)
    return bytes(w.file)
