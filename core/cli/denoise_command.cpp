#include "base/error.h"
#include "cli/commands.h"
#include "cli/denoiser.h"
#include "cli/process/python.h"
#include "cli/shared_options.h"

#include <memory>
#include <string>
#include <vector>

namespace crt {
namespace {

constexpr const char* kDenoiseNotes = R"(
Open Image Denoise guesses the image without its noise. The guess is no measurement: it has no stated error,
and crt marks it (`crt/denoised`) and never writes it over the film or a measured image. Films that hold the
AOVs albedo and normal guide it: details of textures and edges stay. crt's Python package runs it.

  crt scene.yaml -o scene.exr -o scene.crtfilm
  crt denoise scene.crtfilm -o scene.denoised.exr -o scene.denoised.png
)";

struct Request {
    std::string film;
    std::vector<std::string> outputs;
    bool bare = false;
};

}  // namespace

void becomeDenoiser(const std::string& film, const std::vector<std::string>& outputs, bool bare) {
    std::vector<std::string> words{"denoise", film};
    for (const std::string& output : outputs) words.insert(words.end(), {"-o", output});
    if (bare) words.emplace_back("--no-guides");
    becomePythonPackage(words);
    throw Error(ErrorKind::Usage,
                pythonProgram().empty()
                    ? "CRT_PYTHON is empty, and denoising needs Python"
                    : "denoising needs crt's Python package, and python3 has none: docs/install.md says how "
                      "to install it, with its extra 'denoise'; CRT_PYTHON names another Python");
}

Command denoiseCommand() {
    const auto request = std::make_shared<Request>();
    return {.name = "denoise",
            .summary = "guess an image without its noise (Open Image Denoise)",
            .arguments = {{.name = "FILM",
                           .help = "a film (.crtfilm)",
                           .read = [request](const std::string& text) { request->film = text; },
                           .completion = completeFilm()}},
            .groups = {{"Options",
                        {{.names = "-o,--output",
                          .placeholder = "FILE",
                          .help = ".exr, linear, or .png, with the film's exposure; repeatable",
                          .read = [request](const std::string& text) { request->outputs.push_back(text); },
                          .completion = completeFile({"exr", "png"}),
                          .repeatable = true,
                          .required = true},
                         {.names = "--no-guides",
                          .placeholder = {},
                          .help = "do not use the film's albedo and normal",
                          .read = [request](const std::string&) { request->bare = true; }}}}},
            .notes = kDenoiseNotes,
            .run = [request](const std::string&) -> int {
                becomeDenoiser(request->film, request->outputs, request->bare);
                return 0;
            }};
}

}  // namespace crt
