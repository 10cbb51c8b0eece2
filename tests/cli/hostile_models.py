"""Hostile models: the inputs of test_hostile.py that are glTF, GLB, PLY and TGA files. All are made here."""

import base64
import copy
import json
import struct

POSITIONS = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
INDICES = struct.pack("<3H", 0, 1, 2)
TRIANGLE = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
    ],
    "bufferViews": [
        {"buffer": 0, "byteLength": 36},
        {"buffer": 0, "byteOffset": 36, "byteLength": 6},
    ],
    "buffers": [{"byteLength": 42}],
}
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)


def with_data(document, data=POSITIONS + INDICES):
    """The document with its buffer inside, as a data: URI."""
    document = {**document, "buffers": copy.deepcopy(document["buffers"])}
    document["buffers"][0].setdefault(
        "uri", "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    )
    return document


def changed(*places, data=POSITIONS + INDICES):
    """The triangle as text of a glTF file, with values put at ("a/0/b", value); None takes a key away."""
    document = copy.deepcopy(TRIANGLE)
    for place, value in places:
        *path, last = (int(word) if word.isdigit() else word for word in place.split("/"))
        inner = document
        for word in path:
            inner = inner.setdefault(word, {}) if isinstance(inner, dict) else inner[word]
        if value is None:
            del inner[last]
        else:
            inner[last] = value
    return json.dumps(with_data(document, data))


def chunk(kind, data, size=None):
    return struct.pack("<II", len(data) if size is None else size, kind) + data


def glb(*chunks, version=2, length=None):
    body = b"".join(chunks)
    return struct.pack("<4sII", b"glTF", version, 12 + len(body) if length is None else length) + body


def gltf_cases(case):
    def gltf(asked, text, words=(), codes=3, name="a.gltf"):
        case("glTF", asked, ["info", name], codes, words, lambda folder: folder.write(name, text))

    gltf("a triangle", changed(), codes=0)
    gltf("an empty file", b"", "empty")
    gltf("text", "no JSON\n", "a.gltf")
    gltf("no asset", changed(("asset", None)), "'asset' is missing")
    gltf("glTF 1.0", changed(("asset/version", "1.0")), "version 2.0")
    gltf("an unknown extension", changed(("extensionsRequired", ["NO_such"])), "NO_such")
    gltf("KTX2", changed(("extensionsRequired", ["KHR_texture_basisu"])), "KTX2")
    gltf("JSON 100,000 deep", '{"asset":' + "[" * 100000, "nested")
    gltf("an index beyond the vertices", changed(data=POSITIONS + struct.pack("<3H", 0, 1, 7)), "/meshes/0")
    gltf("a vertex of NaN", changed(data=struct.pack("<f", float("nan")) + POSITIONS[4:] + INDICES), "NaN")
    infinite = struct.pack("<f", float("inf"))
    gltf("a vertex of infinity", changed(data=infinite + POSITIONS[4:] + INDICES), "NaN")
    for place, value, words in (
        ("accessors/0/bufferView", 9, "/accessors/0"),
        ("accessors/0/bufferView", -1, "a.gltf"),
        ("accessors/0/count", 0, "/accessors/0/count"),
        ("accessors/0/count", 4, "beyond"),
        ("accessors/0/count", 4294967295, "/accessors/0/count"),
        ("accessors/0/count", 1e300, "a.gltf"),
        ("accessors/0/count", "3", "a.gltf"),
        ("accessors/0/byteOffset", 2**63, "a.gltf"),
        ("accessors/0/byteOffset", -4, "a.gltf"),
        ("accessors/0/componentType", 1, "a.gltf"),
        ("accessors/0/type", "VEC9", "VEC3"),
        ("accessors/1/componentType", 5126, "a.gltf"),
        ("bufferViews/0/buffer", 3, "/bufferViews/0"),
        ("bufferViews/0/byteLength", 10**12, "a.gltf"),
        ("bufferViews/0/byteOffset", 10**12, "a.gltf"),
        ("bufferViews/0/byteStride", 4, "stride"),
        ("bufferViews/0/byteStride", 3, "a.gltf"),
        ("buffers/0/byteLength", 10**15, "a.gltf"),
        ("buffers/0/uri", "../../etc/passwd", "--allow-outside"),
        ("buffers/0/uri", "/etc/passwd", "--allow-outside"),
        ("buffers/0/uri", "%2e%2e/%2e%2e/etc/passwd", "--allow-outside"),
        ("buffers/0/uri", "file:///etc/passwd", "crt does not load"),
        ("buffers/0/uri", "https://example.org/a.bin", "crt does not load"),
        ("buffers/0/uri", "none.bin", "none.bin"),
        ("buffers/0/uri", "data:application/octet-stream;base64,****", "base64"),
        ("scenes/0/nodes", [5], "a.gltf"),
        ("scene", 8, "a.gltf"),
        ("nodes/0/mesh", 5, "there is no mesh 5"),
        ("nodes/0/children", [0], "its own ancestor"),
        ("nodes/0/children", [77], "a.gltf"),
        ("nodes/0/matrix", [0] * 15 + [7], "last row"),
        ("nodes/0/scale", [1e300, 1e300, 1e300], "a.gltf"),
        ("nodes/0/translation", [1, 2], "a.gltf"),
        ("meshes/0/primitives/0/attributes", {}, "nothing is visible"),
        ("meshes/0/primitives/0/mode", 1, "nothing is visible"),
        ("meshes/0/primitives/0/mode", 99, "mode"),
        ("meshes/0/primitives/0/indices", 44, "a.gltf"),
        ("meshes/0/primitives/0/material", 3, "a.gltf"),
    ):
        shown = json.dumps(value)
        shown = shown if len(shown) < 50 else shown[:50] + "…"
        gltf(f"{place} is {shown}", changed((place, value)), words)
    gltf(
        "two nodes that are each other's children",
        changed(("nodes", [{"children": [1], "mesh": 0}, {"children": [0]}])),
        "its own ancestor",
    )
    gltf(
        "nodes 2,000 deep",
        changed(("nodes", [*({"children": [i + 1]} for i in range(2000)), {"mesh": 0}])),
        codes=(0, 3),
    )
    gltf("a million nodes", changed(("nodes", [{"mesh": 0}] + [{}] * 999999)), codes=(0, 3))
    for place in ("nodes", "meshes"):
        gltf(f"{place}/0/name is no text", changed((f"{place}/0/name", "\0\x1b[2J")), codes=0)
    gltf("a material whose name is no text and that crt has not",
         changed(("materials", [{"name": "\x1b[2J", "extensions": {"KHR_materials_subsurface": {}}}]),
                 ("meshes/0/primitives/0/material", 0)), codes=0)
    gltf("a scene without nodes", changed(("scenes/0/nodes", [])), "nothing is visible")
    gltf("a light beyond the list", changed(("nodes/0/extensions/KHR_lights_punctual/light", 4)), "/light")
    gltf(
        "a texture beyond the list",
        changed(
            ("materials", [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 6}}}]),
            ("meshes/0/primitives/0/material", 0),
        ),
        "there is no texture 6",
    )
    gltf(
        "light of 3e38",
        changed(("materials", [{"emissiveFactor": [3e38, 0, 0]}]), ("meshes/0/primitives/0/material", 0)),
        "too large",
    )


def glb_cases(case):
    def model(asked, data, words=(), codes=3):
        case("GLB", asked, ["info", "a.glb"], codes, words, lambda folder: folder.write("a.glb", data))

    text = json.dumps(TRIANGLE).encode()
    text += b" " * (-len(text) % 4)
    data = POSITIONS + INDICES + b"\0\0"
    good = glb(chunk(0x4E4F534A, text), chunk(0x004E4942, data))
    model("a triangle", good, codes=0)
    model("its first 4 bytes", good[:4], "header")
    model("its first 40 bytes", good[:40], "a.glb")
    model("without its last 10 bytes", good[:-10], "ends after")
    model("version 1", glb(chunk(0x4E4F534A, text), version=1), "version 1")
    model("a length of 4 GB", glb(chunk(0x4E4F534A, text), length=2**32 - 1), "ends after")
    model("a chunk of 4 GB", glb(chunk(0x4E4F534A, text, size=2**32 - 4)), "chunk 0")
    model("no chunk", glb(), "a.glb")
    model("bytes before the JSON", glb(chunk(0x004E4942, data), chunk(0x4E4F534A, text)), "first chunk")
    model("without the chunk of bytes", glb(chunk(0x4E4F534A, text)), "a.glb")
    model("a chunk of bytes that is too short", glb(chunk(0x4E4F534A, text), chunk(0x004E4942, b"\0" * 8)),
          "a.glb")
    model("noise as JSON", glb(chunk(0x4E4F534A, bytes(range(256)))), "JSON")


def ply_cases(case, scene, endless_files):
    def ply(asked, text, words=(), codes=3):
        def prepare(folder):
            folder.write("scene.yaml", scene("a.ply"))
            folder.write("a.ply", text)
        case("PLY", asked, ["info", "scene.yaml"], codes, words, prepare)

    def replaced(old, new):
        assert old in PLY
        return PLY.replace(old, new)

    binary = replaced("ascii", "binary_little_endian").split("end_header\n")[0].encode() + b"end_header\n"
    corners = POSITIONS + struct.pack("<B3i", 3, 0, 1, 2)
    ply("a triangle", PLY, codes=0)
    ply("a triangle in binary", binary + corners, codes=0)
    ply("an empty file", "", "a.ply")
    ply("text", "not a model\n" * 10, "'ply'")
    ply("a header without end", replaced("end_header\n", ""), "a.ply:")
    ply("no format", replaced("format ascii 1.0\n", ""), "format")
    ply("version 2.0", replaced("ascii 1.0", "ascii 2.0"), "version 1.0")
    ply("an unknown format", replaced("ascii", "utf8"), "a.ply:2")
    ply("an unknown type", replaced("float x", "real x"), "'real'")
    ply("a property precedes the first element", "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
        "precedes the first element")
    ply("the vertices twice", replaced("element face 1", "element vertex 1"), "twice")
    ply("an element of a name that is no text",
        replaced("element face 1", "element \0\x1b[2J 9\nproperty float q\nelement face 1"), "a.ply")
    ply("a property of a name that is no text, twice",
        replaced("float z\n", "float z\n" + 2 * "property float \x1b]0;a\x07\n"), "twice")
    ply("a texture of a name that is no text",
        replaced("element vertex", "comment TextureFile \x1b[2J\nelement vertex"), codes=0)
    ply("no vertices", replaced("element vertex", "element point"), "'vertex'")
    ply("no z", replaced("property float z\n", ""), "x, y and z")
    ply("no faces", replaced("face 1", "face 0").replace("3 0 1 2\n", ""), "no faces")
    ply("indices as floats", replaced("uchar int", "uchar float"), "integers")
    ply("a length as a float", replaced("uchar int", "float int"), "integer")
    for count in ("4", "-1", "1e9", "18446744073709551615", "99999999999999999999", "4294967295", "x"):
        ply(f"{count} vertices, of which three are there", replaced("vertex 3", f"vertex {count}"), "a.ply")
    for count in ("2", "4000000000"):
        ply(f"{count} faces, of which one is there", replaced("face 1", f"face {count}"), "a.ply")
    for face in ("3 0 1 3", "3 0 1 -1", "3 0 1", "4 0 1 2", "2 0 1", "0", "-3 0 1 2", "3 0 1 2.5", "3 a b c",
                 "255 0 1 2", "3 0 1 99999999999"):
        ply(f"the face '{face}'", replaced("3 0 1 2", face), "a.ply")
    for vertex in ("nan 0 0", "inf 0 0", "1e999 0 0", "1 2", "a b c", "0x10 0 0"):
        ply(f"the vertex '{vertex}'", replaced("1 0 0", vertex), "a.ply")
    ply("the vertex '1 0 0 4', a number more than the header has", replaced("1 0 0", "1 0 0 4"), codes=0)
    for cut in (len(binary) + 10, len(binary) + 37, len(binary) + 44):
        ply(f"binary, cut after {cut} bytes", (binary + corners)[:cut], "a.ply")
    ply("a vertex of NaN in binary", binary + struct.pack("<f", float("nan")) + corners[4:], "a.ply")
    ply("a list of 255 in binary, of which 3 are there",
        binary + POSITIONS + struct.pack("<B3i", 255, 0, 1, 2), "a.ply")
    ply("an index of 2^31 - 1 in binary", binary + POSITIONS + struct.pack("<B3i", 3, 0, 1, 2**31 - 1),
        "a.ply")
    ply("a thousand and one properties",
        replaced("property float z\n", "property float z\n" +
                 "".join(f"property float p{i}\n" for i in range(1001))), "thousand")
    ply("100,000 elements",
        "ply\nformat ascii 1.0\n" + "".join(f"element e{i} 0\n" for i in range(100000)) + "end_header\n",
        "thousand")
    ply("a header of a megabyte without line ends", "ply\n" + "x" * 1000000, "a.ply")
    ply("triangles without area", replaced("1 0 0", "0 0 0"), "area", codes=0)
    for name in ("folder", "pipe", "/dev/zero", "sparse", "none.ply"):
        def prepare(folder, name=name):
            endless_files(folder)
            folder.write("scene.yaml", scene(name))
        case("PLY", f"{name} in place of a PLY", ["info", "scene.yaml"], 3, (), prepare)


def tga(width=4, height=4, kind=2, bits=24, data=None, palette=0):
    size = width * height * (bits // 8)
    head = struct.pack("<BBBHHBHHHHBB", 0, int(palette > 0), kind, 0, palette, 24 if palette else 0, 0, 0,
                       width, height, bits, 0)
    return head + (b"\x80" * min(size, 1 << 16) if data is None else data)


def tga_cases(texture):
    texture("a good TGA", "a.tga", tga(), codes=0)
    texture("a TGA of grey", "a.tga", tga(kind=3, bits=8), codes=0)
    texture("a TGA in runs", "a.tga", tga(kind=10, data=b"\x8f\1\2\3"), codes=0)
    texture("a TGA of a palette", "a.tga", tga(kind=1, bits=8, palette=2, data=b"\0" * 6 + b"\1" * 16),
            codes=(0, 3))
    texture("a TGA whose palette is too short for its texels", "a.tga",
            tga(kind=1, bits=8, palette=2, data=b"\0" * 6 + b"\xff" * 16), "a.tga")
    for cut in (0, 5, 17, 18, 40):
        texture(f"a TGA cut after {cut} bytes", "a.tga", tga()[:cut], "a.tga")
    texture("a TGA of 65535 x 65535 in 18 bytes", "a.tga", tga(65535, 65535, data=b""), "a.tga")
    texture("a TGA of 65535 x 65535 in 100 bytes of runs", "a.tga",
            tga(65535, 65535, kind=10, data=b"\xff\0\0\0" * 20), "a.tga")
    texture("a TGA of no width", "a.tga", tga(0, 4), "a.tga")
    texture("a TGA of 7 bits", "a.tga", tga(bits=7), "a.tga")
    texture("a TGA of kind 99", "a.tga", tga(kind=99), "a.tga")
    texture("a TGA whose run is longer than its picture", "a.tga", tga(kind=10, data=b"\xff\1\2\3"),
            "a.tga", codes=(0, 3))
    texture("a TGA whose runs end early", "a.tga", tga(kind=10, data=b"\x82\1\2\3"), "a.tga")
    texture("noise called TGA", "a.tga", bytes((i * 37 + 11) % 256 for i in range(400)), "a.tga")
