/// tinygltf's structures, for the files that look into them. tinygltf reads no image and no file of its own
/// accord (gltf_file.h): what could do so is left out.
#pragma once

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>
