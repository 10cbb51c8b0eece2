#!/usr/bin/env python3
"""Writes the seeds of the fuzz target gltf: tests/fuzz/gltf_seeds.py tests/fuzz/corpus/gltf"""

import base64
import json
import pathlib
import struct
import sys
import zlib


def png(color, width, height, rows):
    def chunk(name, data):
        crc = zlib.crc32(name + data)
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", crc)

    raw = b"".join(b"\0" + row for row in rows)
    header = struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
            + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


class File:
    def __init__(self):
        self.root = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.bytes = b""

    def add(self, name, item):
        self.root.setdefault(name, []).append(item)
        return len(self.root[name]) - 1

    def view(self, data, **more):
        start = len(self.bytes)
        self.bytes += data + b"\0" * (-len(data) % 4)
        return self.add("bufferViews", {"buffer": 0, "byteOffset": start, "byteLength": len(data)} | more)

    def accessor(self, form, kind, type_, values, **more):
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[type_]
        view = self.view(struct.pack(f"<{len(values)}{form}", *values))
        return self.add("accessors", {"bufferView": view, "componentType": kind, "type": type_,
                                      "count": len(values) // width} | more)

    def node(self, item, root=True):
        number = self.add("nodes", item)
        if root:
            self.root["scenes"][0]["nodes"].append(number)
        return number

    def square(self, **primitive):
        points = self.accessor("f", 5126, "VEC3", [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0])
        uvs = self.accessor("f", 5126, "VEC2", [0, 1, 1, 1, 1, 0, 0, 0])
        attributes = {"POSITION": points, "TEXCOORD_0": uvs} | primitive.pop("attributes", {})
        mesh = {"primitives": [{"attributes": attributes, "mode": 6} | primitive]}
        return self.add("meshes", mesh)

    def gltf(self):
        uri = "data:;base64," + base64.b64encode(self.bytes).decode()
        root = self.root | {"buffers": [{"byteLength": len(self.bytes), "uri": uri}]}
        return json.dumps(root, separators=(",", ":")).encode()

    def glb(self):
        root = self.root | {"buffers": [{"byteLength": len(self.bytes)}]}
        text = json.dumps(root, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I", len(text)) + b"JSON" + text
        chunks += struct.pack("<I", len(self.bytes)) + b"BIN\0" + self.bytes
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def texture(index=0):
    return {"index": index, "extensions": {"KHR_texture_transform": {"scale": [2, 3], "rotation": 1}}}


def painted():
    file = File()
    image = png(6, 2, 2, [bytes([255, 0, 9, 255, 1, 200, 80, 10]), bytes([5, 90, 20, 99, 3, 7, 200, 0])])
    file.add("images", {"bufferView": file.view(image), "mimeType": "image/png"})
    file.add("samplers", {"wrapS": 33071, "magFilter": 9728})
    file.add("textures", {"source": 0, "sampler": 0})
    file.add("materials", {
        "name": "paint", "alphaMode": "MASK", "emissiveFactor": [1, 0, 0], "normalTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorTexture": texture(), "metallicRoughnessTexture": {"index": 0}},
        "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": texture()}}})
    file.node({"mesh": file.square(material=0)})
    return file


def glass():
    file = File()
    file.add("materials", {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [1, 0.5, 1, 1]},
                           "extensions": {
                               "KHR_materials_transmission": {"transmissionFactor": 1},
                               "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2,
                                                        "attenuationColor": [1, 0.5, 0.2]},
                               "KHR_materials_ior": {"ior": 1.6},
                               "KHR_materials_iridescence": {"iridescenceFactor": 1}}})
    file.add("materials", {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5},
                                          "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 0]},
                                          "KHR_materials_specular": {"specularFactor": 0.5}}})
    file.add("materials", {"extensions": {"KHR_materials_unlit": {}}})
    for material in range(3):
        file.node({"mesh": file.square(material=material)})
    return file


def placed():
    file = File()
    mesh = file.square()
    file.add("cameras", {"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 2, "znear": 1}})
    lights = [{"type": "point", "intensity": 9}, {"type": "directional", "color": [1, 0.5, 0]},
              {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}]
    file.root["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    child = file.node({"mesh": mesh, "matrix": [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]}, False)
    file.node({"children": [child], "rotation": [0, 0.6, 0, 0.8], "scale": [1, -2, 3]})
    file.node({"camera": 0, "translation": [0, 0, 5]})
    for light in range(3):
        file.node({"extensions": {"KHR_lights_punctual": {"light": light}}})
    file.node({"mesh": mesh, "skin": 0})
    bind = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    file.add("skins", {"joints": [1], "inverseBindMatrices": file.accessor("f", 5126, "MAT4", bind)})
    return file


def packed():
    file = File()
    colors = file.accessor("B", 5121, "VEC4", [255, 0, 0, 255] * 4, normalized=True)
    strip = file.accessor("H", 5123, "SCALAR", [0, 1, 3, 2])
    mesh = file.square(attributes={"COLOR_0": colors}, indices=strip)
    file.root["meshes"][mesh]["primitives"][0]["mode"] = 5
    file.root["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": file.view(struct.pack("<H", 2)), "componentType": 5123},
        "values": {"bufferView": file.view(struct.pack("<3f", 2, 2, 0))}}
    file.node({"mesh": mesh})
    file.node({"mesh": file.square(mode=1)})
    return file


def main():
    folder = pathlib.Path(sys.argv[1])
    for make in (painted, glass, placed, packed):
        (folder / f"{make.__name__}.gltf").write_bytes(make().gltf())
    (folder / "painted.glb").write_bytes(painted().glb())


if __name__ == "__main__":
    main()
