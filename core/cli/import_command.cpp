#include "base/atomic_file.h"
#include "base/error.h"
#include "base/standard_output.h"
#include "cli/commands.h"
#include "render/output_guard.h"
#include "scene/import/import.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kImportNotes = R"(
The scene refers to the model, whose meshes and images stay in their files; its materials, lights and camera
are written out for editing. A warning, and a comment at the top of the scene, list the features that crt
ignores or approximates and the values that it chose.

  crt import product.glb -o product.yaml
  crt product.yaml --spp 256
  crt product.glb               the same image, without writing a scene
)";

struct Request {
    std::string model, output, variant;
    bool allow_outside = false, overwrite = false;
};

void write(const std::string& path, const std::string& text, bool overwrite) {
    std::error_code unknown;
    if (!overwrite && fs::exists(path, unknown))
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' exists and may have been edited by hand; --overwrite replaces it",
                                path));
    AtomicFile file(path);
    file.write(text.data(), text.size());
    file.commit();
}

int import(const Request& request) {
    if (const std::string other = otherRendererOf(request.model); !other.empty())
        throw Error(ErrorKind::Usage, fmt::format("'{}' is a {} scene; {}", request.model, other,
                                                  importHint(request.model)));
    if (!isModel(request.model))
        throw Error(ErrorKind::Usage,
                    fmt::format("crt cannot import '{}': it reads {}", request.model, kModelEnds));
    const bool to_file = !request.output.empty() && request.output != "-";
    ImportOptions options;
    options.allow_outside = request.allow_outside;
    options.variant = request.variant;
    const std::string end = extensionOf(request.model);
    if (!request.variant.empty() && end != ".glb" && end != ".gltf")
        throw Error(ErrorKind::Usage, "--variant is for glTF files: others have no variants of materials");
    if (to_file) {
        refuseOverInputs({request.model}, {request.output}, {});
        options.folder = fs::path(request.output).parent_path().string();
        if (options.folder.empty()) options.folder = ".";
    } else {
        options.folder = ".";
    }
    GltfFiles files;
    const std::string text = importModel(files, request.model, options).scene;
    if (to_file)
        write(request.output, text, request.overwrite);
    else
        printOut("{}", text);
    return 0;
}

}  // namespace

Command importCommand() {
    const auto request = std::make_shared<Request>();
    return {.name = "import",
            .summary = "convert a model (glTF, GLB, OBJ, PLY, STL) into a scene",
            .arguments = {{.name = "MODEL",
                           .help = "a .glb, .gltf, .obj, .ply or .stl file",
                           .read = [request](const std::string& text) { request->model = text; },
                           .completion = completeFile({"glb", "gltf", "obj", "ply", "stl"})}},
            .groups = {{"Options",
                        {{.names = "-o,--output",
                          .placeholder = "SCENE",
                          .help = "output scene; standard output by default, or -",
                          .read = [request](const std::string& text) { request->output = text; },
                          .completion = completeFile({"yaml", "yml"})},
                         {.names = "--overwrite",
                          .placeholder = {},
                          .help = "replace an existing scene",
                          .read = [request](const std::string&) { request->overwrite = true; }},
                         {.names = "--variant",
                          .placeholder = "NAME",
                          .help = "the materials of this variant of a glTF file (KHR_materials_variants)",
                          .read = [request](const std::string& text) { request->variant = text; }},
                         {.names = "--allow-outside",
                          .placeholder = {},
                          .help = "let a glTF file use buffers and images outside its folder",
                          .read = [request](const std::string&) { request->allow_outside = true; }}}}},
            .notes = kImportNotes,
            .run = [request](const std::string&) { return import(*request); }};
}

}  // namespace crt
