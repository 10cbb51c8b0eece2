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
        throw Error(ErrorKind::Usage, fmt::format("--port {} is above 65535, the last one", text));
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
    "\nThe page shows the image as it converges. Dragging turns the camera around its target, with Shift or "
    "the right button it is\n"
    "moved, the wheel goes nearer and farther; a click shows what the film knows of a pixel, and Ctrl with "
    "a "
    "click focuses a lens.\n"
    "The scene is read again whenever a file that it is made of changes. The address holds a secret: who "
    "knows it, can see the\n"
    "image and change the view. From elsewhere: ssh -L 8080:127.0.0.1:8080 HOST, and there crt view --port "
    "8080.\n"
    "\nExamples:\n"
    "  crt view scene.yaml                           opens a browser, or prints the address\n"
    "  crt view scene.yaml --set film.resolution=[640,360] --spp 4096\n"
    "  crt view scene.yaml --port 8080 --no-open     at a port that stays the same\n";

OptionGroup what(ViewArguments& to) {
    OptionGroup group{"What is shown"};
    group.options = {
        {.names = "--spp",
         .placeholder = "N",
         .help = "samples per pixel, instead of the scene's",
         .read = [&to](const std::string& text) { to.view.samples = parseCount(text, "--spp", 1); }}};
    addSceneChanges(group, to.view.scene);
    return group;
}

OptionGroup where(ViewArguments& to) {
    return {"Where",
            {backendOption(to.view.backend),
             deviceOption(to.view.integrator),
             threadsOption(to.view.integrator),
             {.names = "--port",
              .placeholder = "N",
              .help = "of 127.0.0.1, where the page is (a free one)",
              .read = [&to](const std::string& text) { to.serve.port = parsePort(text); }},
             {.names = "--token",
              .placeholder = "SECRET",
              .help = "in the address, instead of a random one (CRT_VIEW_TOKEN)",
              .read = [&to](const std::string& text) { to.serve.token = parseToken(text); },
              .environment = "CRT_VIEW_TOKEN"},
             {.names = "--no-open",
              .placeholder = {},
              .help = "open no browser",
              .read = [&to](const std::string&) { to.serve.open_browser = false; }}}};
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
                       {"Messages", {quietOption("only the address, warnings and errors")}}},
            .notes = kViewNotes,
            .run = [to](const std::string&) {
                if (to->view.scene.file == "-")
                    throw Error(ErrorKind::Usage, "crt view reads its scene again and again: name a file");
                serveView(to->view, to->serve);
                return 0;
            }};
}

}  // namespace crt
