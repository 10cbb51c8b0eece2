// The one file in which tinygltf is compiled.
#define TINYGLTF_IMPLEMENTATION
#include <fstream>  // Of its writers, which it forgets with TINYGLTF_NO_FS.

#include "scene/gltf/gltf_model.h"
