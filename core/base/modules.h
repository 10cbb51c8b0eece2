/// Where crt finds what is installed with it: plugins, meshes and named data, relative to the file that
/// holds this code (the program, libcrt.so, a Python module), so that an installed tree can be moved.
#pragma once

#include <string>
#include <vector>

namespace crt {

/// Folders searched for plugins, in order: each of CRT_BACKEND_PATH (separated by ':'), then lib/crt of the
/// tree.
std::vector<std::string> pluginDirectories();

/// Folders searched for meshes that are not beside the scene: those of CRT_MESH_PATH (separated by ':'),
/// else share/crt/meshes of the tree.
std::vector<std::string> meshDirectories();

/// Folders searched for named data, in order: those of CRT_DATA_PATH (separated by ':'), then share/crt/data
/// of the tree.
std::vector<std::string> dataDirectories();

/// The folder that Python runs to make pages of reports: share/crt/report of the tree; empty where there is
/// none.
std::string reportProgram();

}  // namespace crt
