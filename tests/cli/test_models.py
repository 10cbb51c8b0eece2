#!/usr/bin/env python3
"""Models of other people, from outside: what is said about a mesh without materials or of another format,
and that McGuire's Cornell box has the luminance that Mitsuba 3 gives to the same numbers.

    test_models.py CRT CONFIG_DIR FAKE_PLUGIN_DIR REPOSITORY BACKEND [unittest arguments]

BACKEND renders the Cornell box; "none" skips that. Python's standard library only."""

import base64
import json
import os
import re
import shutil
import statistics
import struct
import unittest

import harness
from harness import CliTest

SCENE = """crt: 1
camera: {position: [0, 0, 4], target: [0, 0, 0], fov: 40}
film: {resolution: [8, 8]}
materials: {grey: {type: diffuse, reflectance: 0.5}}
objects: [{obj: mesh.obj%s}]
environment: {radiance: 1}
"""
SQUARE = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"


def glb(mesh=0):
    """A square, placed twice; a node names mesh `mesh`, of which there is one."""
    positions = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0)
    root = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": mesh}, {"mesh": 0, "translation": [1.5, 0, 0], "rotation": [0, 0.6, 0, 0.8]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.3, 0, 1], "metallicFactor": 0}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4}],
        "bufferViews": [{"buffer": 0, "byteLength": len(positions)}],
        "buffers": [{"byteLength": len(positions)}],
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I", len(text)) + b"JSON" + text
    chunks += struct.pack("<I", len(positions)) + b"BIN\0" + positions
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


class Imports(CliTest):
    def write_glb(self, **what):
        with open(self.path("a.glb"), "wb") as file:
            file.write(glb(**what))

    def test_a_model_and_its_import_have_equal_pictures(self):
        if BACKEND == "none":
            self.skipTest("there is no backend that renders")
        self.write_glb()
        self.crt("import", "a.glb", "-o", "a.yaml")
        small = ("--spp", "4", "--set", "film.resolution=[48,32]", "-b", BACKEND)
        self.crt("a.glb", *small, "-o", "model.pfm")
        self.crt("a.yaml", *small, "-o", "scene.pfm")
        self.crt("compare", "model.pfm", "scene.pfm", expect=0)
        with open(self.path("model.pfm"), "rb") as one, open(self.path("scene.pfm"), "rb") as other:
            self.assertEqual(one.read(), other.read())

    def test_a_missing_image_of_a_model_in_the_working_folder_is_said_and_the_rest_imported(self):
        data = base64.b64encode(struct.pack("<15f", 0, 0, 0, 1, 0, 0, 0, 1, 0, *[0] * 6)).decode()
        self.write("a.gltf", json.dumps({
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}], "images": [{"uri": "missing.png"}],
            "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0},
                          {"componentType": 5126, "type": "VEC2", "count": 3, "bufferView": 1}],
            "bufferViews": [{"buffer": 0, "byteLength": 36},
                            {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
            "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64," + data}],
        }))
        for name in ("a.gltf", "./a.gltf"):
            done = self.crt("import", name)
            self.assertIn("missing.png", done.stderr)
            self.assertNotIn("outside", done.stderr)

    def test_an_import_replaces_no_model(self):
        self.write("m.obj", SQUARE + "f 1 2 3 4\n")
        before = open(self.path("m.obj")).read()
        done = self.crt("import", "m.obj", "-o", "m.obj", "--overwrite", expect=2)
        self.assertIn("would replace an input file", done.stderr)
        self.assertEqual(open(self.path("m.obj")).read(), before)

    def test_info_describes_images_that_are_textures_alone(self):
        with open(self.path("a.hdr"), "wb") as file:
            file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes([128] * 8))
        done = self.crt("info", "a.hdr")
        self.assertIn("2 x 1 pixels", done.stdout)

    def test_what_was_chosen_is_said_and_written(self):
        self.write_glb()
        done = self.crt("import", "a.glb")
        self.assertIn("# Chosen: the file has no camera.", done.stdout)
        self.assertIn(
            "a.glb: not in the file, so crt chose: a camera that sees the whole model; a grey sky and a "
            "lamp",
            done.stderr,
        )

    def test_a_mesh_that_renders_by_its_name_is_read_and_complained_of_once(self):
        self.write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nf 1 1 2\n")
        self.write("a.mtl", "newmtl a\nKd .5 .5 .5\nmap_Kd gone\\leaf.png\n")
        self.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                   "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
                   "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 0 1\n")
        for model in ("a.obj", "a.ply"):
            with self.subTest(model):
                said = self.crt("info", model).stderr
                self.assertEqual(said.count("without area left out"), 1, said)
        self.assertIn("the image 'gone\\leaf.png' does not exist", self.crt("info", "a.obj").stderr)

    def test_a_white_model_is_seen_against_the_light_that_was_chosen(self):
        """A box of albedo 0.9: its face away from the lamp is 0.9 of the sky, the others far brighter."""
        if BACKEND == "none":
            self.skipTest("there is no backend that renders")
        corners = "".join(f"v {i & 1} {i >> 1 & 1} {i >> 2 & 1}\n" for i in range(8))
        faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
        self.write("box.obj", "mtllib box.mtl\n" + corners + "usemtl white\n" + faces)
        self.write("box.mtl", "newmtl white\nKd 0.9 0.9 0.9\n")
        self.crt("box.obj", "--spp", "64", "--set", "film.resolution=[60,40]", "-b", BACKEND, "-o", "b.pfm")
        with open(self.path("b.pfm"), "rb") as file:
            data = file.read()
        green = struct.unpack("<7200f", data[-28800:])[1::3]

        def luminance(x, y):  # of 3 x 3 pixels; rows from the bottom
            return statistics.mean(green[60 * (y + j) + x + i] for i in (-1, 0, 1) for j in (-1, 0, 1))

        sky, top, front, right = (luminance(x, y) for x, y in ((3, 3), (30, 28), (26, 14), (38, 16)))
        self.assertAlmostEqual(right / sky, 0.9, delta=0.02)
        self.assertGreater(min(top, front) / sky, 1.4)

    def test_a_ply_renders_by_its_name_and_its_import_says_the_same(self):
        if BACKEND == "none":
            self.skipTest("there is no backend that renders")
        self.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                   "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                   "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                   "0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n0 1 0 255 255 255\n4 0 1 2 3\n")
        done = self.crt("import", "a.ply", "-o", "a.yaml")
        self.assertIn("a matt material with the colours of its vertices", done.stderr)
        with open(self.path("a.yaml")) as file:
            self.assertIn("reflectance: {attribute: colors}", file.read())
        small = ("--spp", "4", "--set", "film.resolution=[48,32]", "-b", BACKEND)
        self.crt("a.ply", *small, "-o", "model.pfm")
        self.crt("a.yaml", *small, "-o", "scene.pfm")
        with open(self.path("model.pfm"), "rb") as one, open(self.path("scene.pfm"), "rb") as other:
            self.assertEqual(one.read(), other.read())

    def test_a_scene_that_is_there_is_kept(self):
        self.write_glb()
        self.write("a.yaml", "mine")
        self.assertIn("--overwrite", self.crt("import", "a.glb", "-o", "a.yaml", expect=2).stderr)
        with open(self.path("a.yaml")) as file:
            self.assertEqual(file.read(), "mine")
        self.crt("import", "a.glb", "-o", "a.yaml", "--overwrite")

    def test_what_is_wrong_has_a_place_and_ends_with_3(self):
        self.write_glb(mesh=5)
        for arguments in (("info", "a.glb"), ("import", "a.glb"), ("a.glb", "-b", "fake", "-o", "a.pfm")):
            said = self.crt(*arguments, expect=3).stderr
            self.assertIn("a.glb: /nodes/0/mesh: there is no mesh 5", said)
        self.crt("import", "none.glb", expect=3)
        self.crt("import", "a.yaml", expect=2)


class Meshes(CliTest):
    def render(self, obj, keys=", material: grey", expect=0, mtl=None):
        self.write("mesh.obj", obj)
        if mtl:
            self.write("mesh.mtl", mtl)
        self.write("mesh.yaml", SCENE % keys)
        return self.crt("mesh.yaml", "-b", "fake", "--spp", "1", "-o", "a.pfm", expect=expect).stderr

    def test_a_mesh_without_materials_is_refused_with_the_line_to_add(self):
        said = self.render("mtllib lost.mtl\n" + SQUARE + "usemtl red\nf 1 2 3 4\n", keys="", expect=3)
        self.assertIn(
            "mesh.yaml:5:17: error: 2 of 2 triangles of object 0 have no material (the OBJ refers to "
            "'lost.mtl', which does not exist); give them one with 'material: NAME'",
            said,
        )
        self.assertIn("for instance 'material: grey'", said)
        self.assertFalse(os.path.exists(self.path("a.pfm")))

    def test_the_same_mesh_renders_with_one(self):
        said = self.render("mtllib lost.mtl\n" + SQUARE + "usemtl red\nf 1 2 3 4\n")
        self.assertIn(
            "warning: mesh.obj: material 'red' is not defined, and the file 'lost.mtl' does not exist: 2 of "
            "2 triangles have no material",
            said,
        )

    def test_one_line_says_what_became_of_the_materials(self):
        said = self.render("mtllib mesh.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n", keys="",
                           mtl="newmtl a\nKd 1 1 1\nKs 1 1 1\nd 0\nnewmtl b\nd 0\nNi 1.5\n")
        self.assertEqual(
            [line for line in said.splitlines() if "mesh.obj" in line],
            [
                "crt: warning: mesh.obj: 2 materials: 1 diffuse, 1 glass; d 0 without Ni above 1 read as "
                "opaque (1); dropped: Ks (1)"
            ],
        )

    def test_another_format_is_named(self):
        self.assertIn(
            "mesh.obj: this is a PLY file; use 'ply:' instead of 'obj:'",
            self.render("ply\nformat ascii 1.0\n", expect=3),
        )

    def test_an_index_that_leads_nowhere_is_refused_with_its_line(self):
        self.assertIn(
            "mesh.obj:6: a face uses vertex 7, but the file has 4",
            self.render(SQUARE + "f 1 2 3\nf 1 2 7\n", expect=3),
        )


class CornellBox(CliTest):
    """The reference is what Mitsuba 3 gave in wavelengths when bench/run mtl-agreement was last run
    (out/bench/mtl-agreement.json)."""

    SIZE = 128

    @classmethod
    def setUpClass(cls):
        if BACKEND == "none":
            raise unittest.SkipTest("no backend for this test is built")

    def luminance(self, mtl, samples):
        scenes = os.path.join(REPOSITORY, "bench", "scenes", "mtl")
        for name in os.listdir(scenes):
            shutil.copy(os.path.join(scenes, name), self.directory)
        with open(self.path("cornell_original.obj"), encoding="utf-8") as file:
            obj = file.read()
        self.write("cornell_original.obj", re.sub(r"mtllib \S+", f"mtllib {mtl}", obj))
        self.crt(
            "cornell_original.yaml",
            "-b",
            BACKEND,
            "--spp",
            samples,
            "--set",
            "film.color_space=xyz",
            "-o",
            "a.pfm",
        )
        with open(self.path("a.pfm"), "rb") as file:
            data = file.read()
        header = re.match(rb"PF\n(\d+) (\d+)\n-[0-9.]+\n", data)
        floats = struct.unpack(f"<{self.SIZE * self.SIZE * 3}f", data[header.end():])
        rows = [[floats[3 * (y * self.SIZE + x) + 1] for x in range(self.SIZE)] for y in range(self.SIZE)]
        return rows[::-1]

    def test_luminance_is_that_of_mitsuba_whoever_wrote_the_mtl(self):
        image = self.luminance("cornell_original.mtl", "256")
        with open(
            os.path.join(os.path.dirname(__file__), "cornell_box_by_mitsuba.json"), encoding="utf-8"
        ) as file:
            patches = json.load(file)["patches"]
        self.assertGreater(len(patches), 5)
        for name, patch in patches.items():
            x, y, width, height = patch["x_y_width_height"]
            pixels = [
                value
                for row in image[y : y + height]
                for value in row[x : x + width]
            ]
            # 1 %, and three standard errors of the mean of this image: of 256 samples a pixel, as
            # independent ones would have it.
            noise = statistics.pstdev(pixels) / len(pixels) ** 0.5 if name != "whole image" else 0
            mean = statistics.fmean(pixels)
            self.assertLess(abs(mean - patch["mitsuba_luminance"]), 0.01 * mean + 3 * noise, name)
        # Materials that are equal give the same bits in every sample.
        few = self.luminance("cornell_original.mtl", "16")
        self.assertEqual(self.luminance("maya.mtl", "16"), few)
        self.assertEqual(self.luminance("sponza.mtl", "16"), few)


if __name__ == "__main__":
    REPOSITORY, BACKEND = harness.take_arguments(__doc__, 2)
    unittest.main()
