/// The MTL files that an OBJ names, as exporters of other systems spell them.
#pragma once

#include "scene/mesh/mtl_file.h"
#include "scene/mesh/obj_reader.h"

#include <map>
#include <string>
#include <vector>

namespace crt {

struct MaterialFiles {
    std::map<std::string, MtlText, std::less<>>
        materials;                     ///< By name; of several with one name, the first.
    std::vector<std::string> files;    ///< Those that were read.
    std::vector<std::string> missing;  ///< The first few names that no file could be found for.
};

/// Reads the files of all mtllib statements. A name is taken as it stands; with '/' for '\'; with letters of
/// another case; and then without its folders, beside the OBJ: each of the last three with a warning. The
/// text after mtllib is tried as one name first and then split at its blanks, because exporters do not quote
/// blanks. Where nothing that an OBJ names is there, the MTL with the name of the OBJ serves, with a
/// warning. A file that is missing is no error here.
MaterialFiles readMaterialFiles(const ObjContents& obj, const std::string& obj_path);

}  // namespace crt
