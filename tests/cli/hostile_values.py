"""Hostile values of test_hostile.py: units, suns and skies, exposure, overrides, and Radiance HDR files that
are damaged in each part of their format."""

HEAD = "crt: 1\nfilm: {resolution: [8, 8]}\nsampler: {samples: 2}\n"
OBJECT = ("materials: {m: {type: diffuse, reflectance: 0.5}}\n"
          "objects: [{mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}, material: m}]\n")


def scene_cases(case):
    def scene(asked, text, words, codes=3):
        case("scene", asked, ["info", "scene.yaml"], codes, words,
             lambda folder: folder.write("scene.yaml", text))

    for value, words in (
        ("parsec", "parsec"), ("[mm, cm]", "unit"), ("1e-3", "unit"), ("''", "unit"), ("MM", "mm"),
        ("{mm: 1}", "unit")):
        scene(f"a unit of length: {value}", f"crt: 1\nunit: {value}\n" + HEAD[7:] + OBJECT, words)
    for sky, words in (
        ("{type: 0, zenith_luminance_cd_m2: 1, direction: [0, -1, 0]}", "1 to 15"),
        ("{type: 12, zenith_luminance_cd_m2: -1, direction: [0, -1, 0]}", "zenith_luminance_cd_m2"),
        ("{type: 12, zenith_luminance_cd_m2: 1e300, direction: [0, -1, 0]}", "radiance"),
        ("{type: 12, zenith_luminance_cd_m2: 1, direction: [0, 0, 0]}", "length 0"),
        ("{type: 12, zenith_luminance_cd_m2: 1, direction: [0, -1, 0], up: [0, 0, 0]}", "length 0"),
        ("{type: 12, zenith_luminance_cd_m2: 1, direction: [0, -1, 0], up: [0, -1, 0]}",
         "below the horizon"),
        ("{type: 12, zenith_luminance_cd_m2: 1, direction: [0, -1, 0], rows: 4098}", "rows"),
        ("{type: 12, zenith_luminance_cd_m2: 1, date: 2026-02-30, time: '12:00', latitude_deg: 0, "
         "longitude_deg: 0}", "calendar"),
        ("{type: 12, zenith_luminance_cd_m2: 1, date: 2026-06-21, time: '24:00', latitude_deg: 0, "
         "longitude_deg: 0}", "time of day"),
        ("{type: 12, zenith_luminance_cd_m2: 1, date: 2026-06-21, time: '00:00', latitude_deg: 0, "
         "longitude_deg: 0}", "below the horizon"),
        ("{type: 12, zenith_luminance_cd_m2: 1, date: 9999-01-01, time: '12:00', latitude_deg: 0, "
         "longitude_deg: 0}", "1950"),
        ("{type: 12, zenith_luminance_cd_m2: 1, direction: [0, -1, 0], spectrum: 0}", "no visible light")):
        scene(f"a sky: {sky}", HEAD + f"environment: {{sky: {sky}}}\n" + OBJECT, words)
    for sun, words in (
        ("direction: [0, -1, 0], illuminance_lx: -1", "illuminance_lx"),
        ("direction: [0, -1, 0], illuminance_lx: 1e300", {"radiance", "illuminance_lx"}),
        ("direction: [0, -1, 0], illuminance_lx: 1, angular_diameter_deg: 0", "angular_diameter_deg"),
        ("direction: [0, -1, 0], illuminance_lx: 1, angular_diameter_deg: 91", "angular_diameter_deg"),
        ("direction: [0, -1, 0], illuminance_lx: 1, up: [0, 0, 1]", "exclude each other"),
        ("direction: [.nan, -1, 0], illuminance_lx: 1", "NaN")):
        scene(f"a sun: {sun}", HEAD + f"lights: [{{type: sun, {sun}}}]\n" + OBJECT, words)


def override_cases(case):
    def override(words_of, words, codes=3):
        arguments = [word for value in words_of for word in ("--set", value)]
        case("arguments", " ".join(arguments)[:90], ["info", "scene.yaml", *arguments], codes, words,
             lambda folder: folder.write("scene.yaml", HEAD + OBJECT))

    override(["camera.fov=1", "camera.focal_length=2"], "exclude each other", (2, 3))
    override(["objects.1.material=m"], "objects", (2, 3))
    override(["objects.-1.material=m"], "objects", (2, 3))
    override(["objects.99999999999999999999.material=m"], "objects", (2, 3))
    override(["objects.0.mesh=null"], {"mesh", "shape"}, (2, 3))
    override(["film=null", "film.resolution=[0, 0]"], "resolution", (2, 3))
    override(["crt=2"], "crt", (2, 3))
    override(["materials.m=[[[[[[[["], "YAML", (2, 3))
    override(["materials.m={type: diffuse, reflectance: *a}"], "YAML", (2, 3))
    override(["." * 200 + "=1"], {"=", "key"}, (2, 3))
    override(["camera.position=" + "[" * 5000], {"deep", "YAML"}, (2, 3))
    for value in ("auto", "1e400", "nan", "12 stops"):
        case("arguments", f"--set film.exposure_ev={value}",
             ["info", "scene.yaml", "--set", f"film.exposure_ev={value}"], (2, 3), "exposure_ev",
             lambda folder: folder.write("scene.yaml", HEAD + OBJECT))
    for value in ("", "bright", "auto,auto"):
        case("arguments", f"--expose '{value}'", ["scene.yaml", "--expose", value, "-o", "a.ppm"], 2,
             "--expose", lambda folder: folder.write("scene.yaml", HEAD + OBJECT))


def radiance_cases(case):
    top = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"

    def radiance(asked, data, words, codes=3):
        def prepare(folder):
            folder.write("scene.yaml", HEAD + "environment: {image: sky.hdr}\n" + OBJECT)
            folder.write("sky.hdr", data)
        case("image", f"a Radiance HDR {asked}", ["info", "scene.yaml"], codes, words, prepare)

    rows = b"\x80\x80\x80\x80" * 8
    radiance("of 4 x 2 pixels", top + b"-Y 2 +X 4\n" + rows, (), 0)
    radiance("that ends in its header", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "sky.hdr")
    radiance("without a size", top, "sky.hdr")
    radiance("of 0 pixels", top + b"-Y 0 +X 0\n", "sky.hdr")
    radiance("of fewer rows than none", top + b"-Y -2 +X 4\n" + rows, "sky.hdr")
    radiance("of 2^32 columns", top + b"-Y 2 +X 4294967296\n" + rows, "sky.hdr")
    radiance("of 40,000 x 80,000 pixels in 100 bytes", top + b"-Y 40000 +X 80000\n" + rows, "sky.hdr")
    radiance("whose axes are both Y", top + b"-Y 2 +Y 4\n" + rows, "sky.hdr")
    radiance("that ends in a row", top + b"-Y 2 +X 4\n" + rows[:9], "sky.hdr")
    radiance("of another format", top.replace(b"rgbe", b"cmyk") + b"-Y 2 +X 4\n" + rows, "sky.hdr")
    radiance("whose exposure is 0", b"#?RADIANCE\nEXPOSURE=0\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + rows,
             "EXPOSURE")
    radiance("whose exposure is no number",
             b"#?RADIANCE\nEXPOSURE=bright\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + rows, "EXPOSURE")
    wide = top + b"-Y 8 +X 16\n"
    radiance("whose run is longer than its row", wide + b"\x02\x02\x00\x10\xff\x80", "sky.hdr")
    radiance("whose run has the length 0", wide + b"\x02\x02\x00\x10\x00\x80", "sky.hdr")
    radiance("whose row says another width", wide + b"\x02\x02\x00\x20\x90\x80", "sky.hdr")
    radiance("that begins with an old run", top + b"-Y 2 +X 4\n" + b"\x01\x01\x01\xff" + rows, "sky.hdr")
    radiance("of old runs to 2^32 pixels",
             top + b"-Y 2 +X 4\n" + b"\x80\x80\x80\x80" + b"\x01\x01\x01\xff" * 4, "sky.hdr")
    radiance("with a header of a megabyte", b"#?RADIANCE\n" + b"#" * 1000000 + b"\n" + top[11:]
             + b"-Y 2 +X 4\n" + rows, "header")


def add(case):
    scene_cases(case)
    override_cases(case)
    radiance_cases(case)
