#include "base/error.h"
#include "base/log.h"
#include "cli/arguments.h"
#include "cli/commands.h"
#include "cli/shared_options.h"
#include "view/serve.h"

#include <algorithm>
#include <cctype>
#include <memory>
#include <string>

namespace crt {
namespace {

struct ViewArguments {
    ViewOptions view;
    ServeOptions serve;
};

std::uint16_t parsePort(const std::string& text) {
    const std::uint64_t port = parseCount(text, "--port", 0);
    if (port > 65535)
        throw Error(ErrorKind::Usage, fmt::format("--port {} is too large: the largest port is 65535",
                                                  text));
    return static_cast<std::uint16_t>(port);
}

std::string parseToken(const std::string& text) {
    const bool plain =
        std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isalnum(c); });
    if (text.size() < 16 || !plain)
        throw Error(ErrorKind::Usage, "--token takes 16 or more letters and digits");
    return text;
}

constexpr const char* kViewNotes =
    "\nThe page shows the image as it converges. Drag to turn the camera around its target, or with Shift "
    "or the right button to move it;\n"
    "the wheel changes the distance. A click shows the data of a pixel, and Ctrl with a click focuses a "
    "lens.\n"
    "crt reads the scene again whenever one of its files changes. The address contains a secret: everyone "
    "who has it can see the\n"
    "image and change the view. For remote access: ssh -L 8080:127.0.0.1:8080 HOST, and there crt view "
    "--port 8080.\n"
    "\nExamples:\n"
    "  crt view scene.yaml                           opens a browser, or prints the address\n"
    "  crt view scene.yaml --set film.resolution=[640,360] --spp 4096\n"
    "  crt view scene.yaml --port 8080 --no-open     at a port that stays the same\n"
    "  crt view scene.yaml --tev localhost:14158     in the viewer tev as well\n";

OptionGroup what(ViewArguments& to) {
    OptionGroup group{"Scene"};
    group.options = {
        {.names = "--spp",
         .placeholder = "N",
         .help = "samples per pixel, instead of the scene's",
         .read = [&to](const std::string& text) { to.view.samples = parseCount(text, "--spp", 1); }}};
    addSceneChanges(group, to.view.scene);
    return group;
}

OptionGroup where(ViewArguments& to) {
    return {"Device and address",
            {backendOption(to.view.backend),
             deviceOption(to.view.integrator),
             threadsOption(to.view.integrator),
             {.names = "--port",
              .placeholder = "N",
              .help = "port of 127.0.0.1 for the page (a free one)",
              .read = [&to](const std::string& text) { to.serve.port = parsePort(text); }},
             {.names = "--token",
              .placeholder = "SECRET",
              .help = "secret in the address, instead of a random one (CRT_VIEW_TOKEN)",
              .read = [&to](const std::string& text) { to.serve.token = parseToken(text); },
              .environment = "CRT_VIEW_TOKEN"},
             {.names = "--no-open",
              .placeholder = {},
              .help = "do not open a browser",
              .read = [&to](const std::string&) { to.serve.open_browser = false; }},
             {.names = "--tev",
              .placeholder = "HOST:PORT",
              .help = "send the image to the viewer tev, too",
              .read = [&to](const std::string& text) { to.view.tev = parseTevAddress(text); }}}};
}

}  // namespace

Command viewCommand() {
    const auto to = std::make_shared<ViewArguments>();
    return {.name = "view",
            .summary = "show a scene in a browser while it renders, and move the camera",
            .arguments = {{.name = "SCENE",
                           .help = "scene file (YAML) or model",
                           .read = [to](const std::string& text) { to->view.scene.file = text; },
                           .completion = completeScene()}},
            .groups = {what(*to),
                       where(*to),
                       {"Messages", {quietOption("print only the address, warnings and errors")}}},
            .notes = kViewNotes,
            .run = [to](const std::string&) {
                if (to->view.scene.file == "-")
                    throw Error(ErrorKind::Usage, "crt view reads its scene repeatedly: name a file");
                serveView(to->view, to->serve);
                return 0;
            }};
}

}  // namespace crt
