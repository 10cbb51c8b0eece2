"""More hostile inputs of test_hostile.py: few bytes that ask for much work or memory, names and links that
others choose, and values at the edge of their files' formats. All are made here."""

import json
import os
import resource
import struct
import zlib

from hostile_models import TRIANGLE, chunk, glb, POSITIONS

HEAD = "crt: 1\nfilm: {resolution: [8, 8]}\nsampler: {samples: 2}\n"
SPHERE = "materials: {m: {type: mirror, reflectance: 1}}\nobjects: [{sphere: {radius: 1}, material: m}]\n"
MESH = "mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}"


def spheres(count, material):
    """As many materials, and a sphere of each."""
    text = HEAD + "environment: {radiance: 1}\nmaterials:\n"
    text += "".join(f"  m{i}: {{type: {material(i)}}}\n" for i in range(count))
    text += "objects:\n"
    return text + "".join(f"- {{sphere: {{radius: 1}}, material: m{i}}}\n" for i in range(count))


def material_cases(case):
    def scene(asked, text, codes=3, words=()):
        case(
            "scene", asked, ["info", "scene.yaml"], codes, words,
            lambda folder: folder.write("scene.yaml", text),
        )

    too_long = ("scene.yaml:", "rough materials", "CRT_TABLE_SECONDS=")
    scene(
        "10,000 rough glasses that differ (1 MB)",
        spheres(
            10000,
            lambda i: f"rough_dielectric, ior: {1.1 + i * 1e-4:.4f}, roughness: {0.1 + i * 3e-5:.5f}",
        ),
        words=too_long,
    )
    scene(
        "60 anisotropic rough glasses that differ (10 kB)",
        spheres(
            60, lambda i: f"rough_dielectric, ior: 1.5, roughness: 0.{100 + i}, roughness_anisotropy: 0.7"
        ),
        words=too_long,
    )
    scene(
        "100 rough glasses behind films that differ",
        spheres(100, lambda i: "rough_dielectric, ior: 1.5, roughness: 0.3, "
                               f"thin_film: {{thickness_nm: {200 + i}, ior: 1.3}}"),
        words=too_long,
    )
    scene(
        "10,000 plastics that differ",
        spheres(10000, lambda i: f"plastic, reflectance: 0.5, roughness: 0.{i + 20000}"),
        words=too_long,
    )
    scene(
        "5,000 metals of one kind",
        spheres(5000, lambda i: "rough_conductor, metal: Au, roughness: 0.3"),
        0,
    )
    scene(
        "1,000 glasses of one kind", spheres(1000, lambda i: "rough_dielectric, ior: 1.5, roughness: 0.3"), 0
    )
    scene(
        "10,000 mixes of one material",
        spheres(10000, lambda i: "mix, materials: [m0, m0], amount: 0.5" if i else "mirror, reflectance: 1"),
        0,
    )


def black_png(width, height):
    """Of grey texels, in a thousandth of their bytes."""
    head = png_part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    texels = png_part(b"IDAT", packed_zeros((width + 1) * height))
    return b"\x89PNG\r\n\x1a\n" + head + texels + png_part(b"IEND", b"")


def packed_zeros(count):
    """A zlib stream (RFC 1950): one block that is packed once, as often as it fits, and the rest."""
    block = 1 << 20
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = packer.compress(bytes(block)) + packer.flush(zlib.Z_FULL_FLUSH)
    rest = packer.compress(bytes(count % block)) + packer.flush()
    return b"\x78\xda" + packed * (count // block) + rest + struct.pack(">HH", count % 65521, 1)


def png_part(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def large_scene_cases(case):
    def environment(folder):
        folder.write("scene.yaml", HEAD + f"environment: {{image: sky.png}}\n{SPHERE}")
        folder.write("sky.png", black_png(16384, 8192))

    def one_line(folder):
        """As crt.scene(dict) of Python writes scenes: the column of each object is counted in megabytes."""
        document = {
            "crt": 1,
            "title": "x" * 4000000,
            "film": {"resolution": [8, 8]},
            "environment": {"radiance": 1},
            "materials": {"m": {"type": "diffuse", "reflectance": 0.5}},
            "objects": [{"sphere": {"radius": 1}, "material": "m"}] * 20000,
        }
        folder.write("scene.yaml", json.dumps(document))

    render = ["scene.yaml", "-b", "fake", "-o", "a.pfm"]
    case("scene", "an environment of 16384 x 8192 black texels in 130 kB", render, 3,
         ("scene.yaml:4:", "sky.png", "CRT_SCENE_MEMORY="), environment,
         limits={resource.RLIMIT_AS: 4 << 30})  # Written out it takes 7 GB.
    case("scene", "20,000 objects behind 4 MB in one line", ["info", "scene.yaml"], 0, (), one_line)


def model_cases(case):
    def model(asked, document, codes, words=()):
        data = json.dumps(document, separators=(",", ":")).encode()
        data = glb(chunk(0x4E4F534A, data + b" " * (-len(data) % 4)), chunk(0x004E4942, POSITIONS))
        case(
            "GLB", asked, ["info", "a.glb"], codes, words,
            lambda folder: folder.write("a.glb", data),
        )

    document = {
        **TRIANGLE,
        "accessors": TRIANGLE["accessors"][:1],
        "bufferViews": TRIANGLE["bufferViews"][:1],
        "buffers": [{"byteLength": 36}],
    }
    plain = {"attributes": {"POSITION": 0}}
    model("100,000 primitives in a mesh", {**document, "meshes": [{"primitives": [plain] * 100000}]}, 0)
    model(
        "100,000 meshes of points",
        {**document, "meshes": [{"primitives": [{**plain, "mode": 0}]}] * 100000},
        3,
        "nothing is visible",
    )
    model(
        "5,000 metals that differ in roughness",
        {
            **document,
            "meshes": [{"primitives": [{**plain, "material": i} for i in range(5000)]}],
            "materials": [
                {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0.1 + i / 10000}}
                for i in range(5000)
            ],
        },
        3,
        ("a.glb", "CRT_TABLE_SECONDS="),
    )


def spectrum_cases(case):
    def spectrum(asked, text, codes=3, words=()):
        def prepare(folder):
            folder.write(
                "scene.yaml",
                HEAD
                + "materials: {m: {type: diffuse, reflectance: {file: s.spd, outside: clamp}}}\n"
                + f"objects: [{{{MESH}, material: m}}]\n",
            )
            folder.write("s.spd", text)
        case("spectrum", f"a spectrum file: {asked}", ["info", "scene.yaml"], codes, words, prepare)

    spectrum("300,000 wavelengths within a nanometre",
             "".join(f"{500 + i / 300000:.7f} 0.5\n" for i in range(300000)), 0)
    spectrum("UTF-16", "400 0.5\n700 0.5\n".encode("utf-16"), 3, "s.spd")
    spectrum("a wavelength twice", "400 0.5\n500 0.5\n500 0.6\n", 3, "s.spd:3")
    spectrum("a wavelength of 1e308", "400 0.5\n1e308 0.5\n", (0, 3))
    spectrum("negative wavelengths", "-700 0.5\n-400 0.5\n", 3, "wavelengths are above 0")


def light_cases(case):
    def ies(asked, text, codes=3, words=()):
        def prepare(folder):
            folder.write(
                "scene.yaml",
                HEAD
                + f"materials: {{m: {{type: mirror, reflectance: 1}}}}\nobjects: [{{{MESH}, material: m}}]\n"
                + "lights: [{type: ies, position: [0, 0, 1], file: a.ies}]\n",
            )
            folder.write("a.ies", text)
        case("scene", f"an IES file {asked}", ["info", "scene.yaml"], codes, words, prepare)

    begin = "IESNA:LM-63-2002\nTILT=NONE\n"
    ies("with 100,000 lines of keywords", "IESNA:LM-63-2002\n" + "[OTHER] x\n" * 100000, words="a.ies")
    ies("with a line of ten megabytes", "IESNA:LM-63-2002\n" + "x" * 10000000, words="a.ies")
    ies("with a tilt of a thousand million angles",
        "IESNA:LM-63-2002\nTILT=INCLUDE\n1\n1000000000\n0 90\n", words="a.ies")
    ies("with a multiplier of 1e300", begin + "1 1000 1e300 2 1 1 2 0 0 0\n1e300 1 10\n0 90\n0\n1 1\n",
        words="a.ies")
    ies("of NaN angles", begin + "1 1000 1 2 1 1 2 0 0 0\n1 1 10\n0 nan\n0\n1 1\n", words="a.ies")


def texture_cases(texture, png):
    whole = png(8, 8)
    data_at = whole.index(b"IDAT") - 4

    end = png_part(b"IEND", b"")
    bomb = png_part(b"IDAT", packed_zeros(200 << 20))
    texture("a PNG with 200 MB behind its last row", "a.png", whole[:data_at] + bomb + end, codes=(0, 3))
    texture("a PNG without texels", "a.png", whole[:data_at] + end, "a.png")
    text = png_part(b"zTXt", b"a\0\0" + packed_zeros(200 << 20))
    texture("a PNG with a text of 200 MB", "a.png", whole[:data_at] + text + whole[data_at:], codes=(0, 3))
    profile = png_part(b"iCCP", b"a\0\0" + packed_zeros(200 << 20))
    texture("a PNG with a colour profile of 200 MB", "a.png", whole[:33] + profile + whole[33:], "(ICC) 'a'",
            codes=0)
    texture("a Radiance HDR of primaries without colours", "a.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"
            b"PRIMARIES=.3 .3 .3 .3 .3 .3 .3 .3\n\n-Y 1 +X 1\n\x80\x80\x80\x80", "span no colours")
    texture("a PNG with two headers", "a.png", whole[:33] + whole[8:], codes=(0, 3))
    texture("a PNG with a wrong checksum", "a.png", whole[:29] + b"\0\0\0\0" + whole[33:], codes=(0, 3))
    line = b"\x02\x02\x40\x00" + (b"\xff\0" * 129 + b"\x81\0") * 4
    texture("a Radiance HDR of 16384 x 8192 black texels in 9 MB", "a.hdr",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n" + line * 8192, "CRT_SCENE_MEMORY=")
    texture("a Radiance HDR of 10^9 x 10^9 texels", "a.hdr",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000000 +X 1000000000\n", "a.hdr")


def name_cases(case, good, fake_plugin):
    def output(asked, name, words):
        def prepare(folder):
            good(folder)
            with open(folder / "scene.yaml", "a", encoding="utf-8") as file:
                file.write(f"outputs: [{{file: {json.dumps(name)}, format: ppm}}]\n")
        case("scene", f"an output {asked}", ["scene.yaml", "-b", "fake"], (2, 3), words, prepare)

    output("in the folder above", "../a.ppm", "../a.ppm")
    output("with a name from the root", "/tmp/crt-hostile.ppm", "/tmp/crt-hostile.ppm")
    output("of a hidden name", ".profile", ".profile")
    output("in a hidden folder", ".ssh/authorized_keys.ppm", ".ssh")
    output("of another kind of file", "a.sh", "a.sh")

    def plugin(asked, codes, words, link):
        def prepare(folder):
            good(folder)
            os.mkdir(folder / "plugins", 0o755)
            os.mkdir(folder / "real", 0o755)
            path = folder / "real/crt_backend_planted.so"
            with open(fake_plugin, "rb") as file:
                folder.write("real/crt_backend_planted.so", file.read())
            os.chmod(path, 0o755)
            link(folder, path, folder / "plugins/crt_backend_planted.so")
        arguments = ["scene.yaml", "-b", "planted", "-o", "a.pfm"]
        case("plugins", asked, arguments, codes, words, prepare, env={"CRT_BACKEND_PATH": "plugins"})

    def open_folder(folder, path, name):
        os.symlink(path, name)
        os.chmod(folder / "plugins", 0o777)

    def by_open_folder(folder, path, name):
        os.mkdir(folder / "open", 0o777)
        os.chmod(folder / "open", 0o777)
        os.symlink(folder / "real", folder / "open/real")
        os.symlink(folder / "open/real/crt_backend_planted.so", name)

    def of_another_user(folder, path, name):
        os.symlink(path, name)
        os.chmod(folder / "plugins", 0o1777)
        os.lchown(name, 65534, 65534)

    plugin("a link to a plugin", 0, (), lambda _, path, name: os.symlink(path, name))
    plugin("a link to a plugin in a folder that everyone can write to", 4,
           "is refused: everyone can write to", open_folder)
    plugin("a link by way of a folder that everyone can write to", 4,
           "is refused: everyone can write to", by_open_folder)
    plugin("a link to nowhere as plugin", 4, "cannot be opened",
           lambda _, path, name: os.symlink("none", name))
    if os.geteuid() == 0:
        plugin("another user's link to a plugin, in a sticky folder", 4, "is a link of another user",
               of_another_user)


def environment_cases(with_variable, glass):
    with_variable("CRT_TABLE_SECONDS=soon", 2, "CRT_TABLE_SECONDS", prepare=glass, CRT_TABLE_SECONDS="soon")
    with_variable("CRT_TABLE_SECONDS=-1", 2, "CRT_TABLE_SECONDS", prepare=glass, CRT_TABLE_SECONDS="-1")
    with_variable("CRT_TABLE_SECONDS=1e-9 and a rough glass", 3, "CRT_TABLE_SECONDS=", prepare=glass,
                  CRT_TABLE_SECONDS="1e-9")
    with_variable("CRT_MESH_PATH=/dev/zero", 0, CRT_MESH_PATH="/dev/zero")
    with_variable("CRT_DATA_PATH of 100 kB", 0, CRT_DATA_PATH=":".join(["/dev/zero"] * 10000))
    with_variable("SOURCE_DATE_EPOCH=soon", 2, "SOURCE_DATE_EPOCH", SOURCE_DATE_EPOCH="soon")
    with_variable("SOURCE_DATE_EPOCH=-99999999999999999999", 2, "SOURCE_DATE_EPOCH",
                  SOURCE_DATE_EPOCH="-99999999999999999999")


def argument_cases(words_of):
    render = ["scene.yaml", "-b", "fake", "-o", "a.pfm"]
    changes = [word for i in range(5000) for word in ("--set", f"a.b{i}=1")]
    words_of("5,000 different --set", [*render, *changes], 3)
    words_of("an output with a line break in its name", [*render[:3], "-o", "a\nb.pfm"], (0, 6))
    words_of("a scene with an escape sequence in its name", ["a\x1b[31m.yaml"], (2, 3))
    words_of("a checkpoint of /dev/zero to resume", [*render, "--resume", "/dev/zero"], (2, 3))
    words_of("a backend of control characters", ["scene.yaml", "-b", "\x01\x7f", "-o", "a.pfm"], 4)
