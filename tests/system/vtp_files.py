"""Surfaces as VTK XML PolyData in every encoding that the format has, by its documentation ("VTK XML file formats" at docs.vtk.org)
and by nothing of the page that reads them."""
import base64
import collections
import itertools
import math
import struct
import zlib

CODES = {"Int32": "i", "Int64": "q", "UInt8": "B", "Float32": "f", "Float64": "d"}
Encoding = collections.namedtuple("Encoding", "format compressed header order points indices block_bytes",
                                  defaults=("ascii", False, "UInt32", "LittleEndian", "Float32", "Int64", 64))
Surface = collections.namedtuple("Surface", "points polys strips")


def prism():
    """A closed surface whose caps have seven corners and whose sides have four: cells of different sizes."""
    sides = 7
    ring = lambda z, r: [(r * math.cos(2 * math.pi * k / sides) + 3.25, r * math.sin(2 * math.pi * k / sides) - 41.5, z) for k in range(sides)]
    polys = [list(range(sides))[::-1], list(range(sides, 2 * sides))]
    polys += [[k, (k + 1) % sides, sides + (k + 1) % sides, sides + k] for k in range(sides)]
    return Surface(ring(-20.125, 11) + ring(33.5, 14), polys, [])


def prism_of_strips():
    """The same: its sides are one strip of triangles that goes round."""
    whole = prism()
    sides = [index for k in range(8) for index in (7 + k % 7, k % 7)]
    return Surface(whole.points, whole.polys[:2], [sides])


def triangles_of(surface):
    """Every triangle as three points, in single precision, turned so that the least corner comes first."""
    indices = [(poly[0], b, c) for poly in surface.polys for b, c in zip(poly[1:], poly[2:])]
    for strip in surface.strips:
        indices += [(a, b, c) if i % 2 == 0 else (a, c, b) for i, (a, b, c) in enumerate(zip(strip, strip[1:], strip[2:]))]
    return turned([tuple(single(surface.points[index]) for index in triangle) for triangle in indices])


def turned(triangles):
    return sorted(min(triangle[k:] + triangle[:k] for k in range(3)) for triangle in triangles)


def single(point):
    return struct.unpack("<3f", struct.pack("<3f", *point))


class Writer:
    """Of one file. `axes`: as 3D Slicer says them in an array of texts."""

    def __init__(self, encoding, axes=""):
        self.encoding = encoding
        self.axes = axes
        self.appended = b""

    def write(self, *surfaces):
        """One piece each."""
        encoding = self.encoding
        compressor = ' compressor="vtkZLibDataCompressor"' if encoding.compressed else ""
        axes = f'<FieldData>{self.array("UInt8", "SPACE", [*self.axes.encode(), 0], written="String")}</FieldData>' if self.axes else ""
        pieces = "".join(self.piece(surface) for surface in surfaces)
        text = (f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="{encoding.order}" header_type="{encoding.header}"{compressor}>\n'
                f"  <PolyData>\n{axes}{pieces}  </PolyData>\n").encode()
        if self.appended:
            kind = encoding.format.partition(" ")[2]
            text += f'  <AppendedData encoding="{kind}">\n   _'.encode() + self.appended + b"\n  </AppendedData>\n"
        return text + b"</VTKFile>\n"

    def piece(self, surface):
        points = [x for point in surface.points for x in point]
        cells = "".join(f"<{name}>{self.cells(cells)}</{name}>\n" for name, cells in (("Verts", []), ("Lines", []), ("Strips", surface.strips), ("Polys", surface.polys)))
        return (f'<Piece NumberOfPoints="{len(surface.points)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="{len(surface.strips)}" '
                f'NumberOfPolys="{len(surface.polys)}">\n<PointData Scalars="s">{self.array("Float32", "s", [0.5] * len(surface.points))}</PointData>\n'
                f'<Points>{self.array(self.encoding.points, "Points", points, 3)}</Points>\n{cells}</Piece>\n')

    def cells(self, cells):
        ends = list(itertools.accumulate(map(len, cells)))
        kind = self.encoding.indices
        return self.array(kind, "connectivity", [index for cell in cells for index in cell]) + self.array(kind, "offsets", ends)

    def array(self, kind, name, numbers, components=1, written=None):
        encoding = self.encoding.format.partition(" ")[0]
        head = f'{"Array" if written else "DataArray"} type="{written or kind}" Name="{name}" NumberOfComponents="{components}" format="{encoding}"'
        # As VTK writes what is known of an array, beside its numbers.
        about = '<InformationKey name="L2_NORM_RANGE" location="vtkDataArray" length="2"><Value index="0">12.5</Value></InformationKey>'
        if encoding == "ascii":
            return f"<{head}>\n{' '.join(map(str, numbers))}\n{about}</{head.split()[0]}>\n"
        order = "<" if self.encoding.order == "LittleEndian" else ">"
        head_part, data = self.packed(struct.pack(f"{order}{len(numbers)}{CODES[kind]}", *numbers))
        if self.encoding.format == "appended raw":
            text = head_part + data
        elif self.encoding.compressed:
            text = base64.b64encode(head_part) + base64.b64encode(data)  # each with its own padding
        else:
            text = base64.b64encode(head_part + data)
        if encoding == "binary":
            return f"<{head}>\n   {text.decode()}\n{about}</{head.split()[0]}>\n"
        self.appended += text
        return f'<{head} offset="{len(self.appended) - len(text)}">{about}</{head.split()[0]}>\n'

    def packed(self, data):
        """What stands before the data, and these."""
        order = "<" if self.encoding.order == "LittleEndian" else ">"
        numbers = lambda *values: struct.pack(f"{order}{len(values)}{'Q' if self.encoding.header == 'UInt64' else 'I'}", *values)
        if not self.encoding.compressed:
            return numbers(len(data)), data
        size = self.encoding.block_bytes
        blocks = [zlib.compress(data[at:at + size]) for at in range(0, len(data), size)]
        return numbers(len(blocks), size, len(data) % size, *map(len, blocks)), b"".join(blocks)


def encodings():
    """Each way of writing with each of the others once at least; not all of them with all."""
    for form in ("ascii", "binary", "appended base64", "appended raw"):
        for compressed in (False, True):
            for header, order, points, indices, block in (("UInt32", "LittleEndian", "Float32", "Int64", 64), ("UInt64", "LittleEndian", "Float64", "Int32", 56),
                                                          ("UInt64", "BigEndian", "Float32", "Int64", 32768), ("UInt32", "BigEndian", "Float64", "Int32", 8)):
                yield Encoding(form, compressed, header, order, points, indices, block)


def stl(triangles):
    return b"tubed".ljust(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *(x for corner in triangle for x in corner), 0) for triangle in triangles)


def text_stl(triangles):
    corner = lambda p: "vertex {} {} {}\n".format(*map(repr, p))
    return ("solid vessel\n" + "".join(f"facet normal 0 0 0\nouter loop\n{''.join(map(corner, triangle))}endloop\nendfacet\n" for triangle in triangles)
            + "endsolid vessel\n").encode()
