#include "view/pages.h"

#include "base/error.h"
#include "base/words.h"
#include "changes.js.h"
#include "gestures.js.h"
#include "index.html.h"
#include "panel.js.h"
#include "pixel.js.h"
#include "view.css.h"
#include "view.js.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <utility>

namespace crt {
namespace {

std::uint64_t numberIn(const HttpRequest& request, const std::string& key) {
    const auto found = request.query.find(key);
    const auto parsed = parseUnsigned(found != request.query.end() ? found->second : "");
    if (!parsed.value) throw Error(ErrorKind::Usage, fmt::format("the request lacks the number '{}'", key));
    return *parsed.value;
}

void putInPlace(std::string& text, const std::string& mark, const std::string& what) {
    for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + what.size()))
        text.replace(at, mark.size(), what);
}

/// One file, so that a browser needs one request and its scripts no addresses.
HttpReply wholePage() {
    std::string html = page::kIndexHtml;
    putInPlace(html, "<!-- style -->", page::kViewCss);
    putInPlace(html, "<!-- script -->", std::string(page::kViewJs) + page::kChangesJs +
                                             page::kGesturesJs + page::kPanelJs + page::kPixelJs);
    const std::string nonce = randomToken();
    putInPlace(html, "<!-- nonce -->", nonce);
    return {.type = "text/html; charset=utf-8",
            .body = std::move(html),
            .headers = {{"Content-Security-Policy",
                         fmt::format("default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; "
                                     "connect-src 'self'; img-src data:; frame-ancestors 'none'; "
                                     "base-uri 'none'; form-action 'none'",
                                     nonce)}}};
}

/// The length of a JSON text, the text, and behind it the picture's pixels unless the page has them.
HttpReply state(Viewer& viewer, const HttpRequest& request) {
    constexpr std::chrono::seconds kLongestWait{15};
    const ViewState::Copy now = viewer.state().waitBeyond(numberIn(request, "after"), kLongestWait);
    if (now.closed) return {.status = 503, .body = "crt view ends"};
    const std::string json = stateJson(now);
    const bool send = now.picture && now.picture->number != numberIn(request, "picture");
    static_assert(std::endian::native == std::endian::little, "the page reads a little-endian length");
    const auto length = static_cast<std::uint32_t>(json.size());
    HttpReply reply{.type = "application/octet-stream"};
    reply.body.reserve(sizeof length + json.size() + (send ? now.picture->rgba.size() : 0));
    reply.body.append(reinterpret_cast<const char*>(&length), sizeof length);
    reply.body += json;
    if (send) reply.body.append(now.picture->rgba.begin(), now.picture->rgba.end());
    return reply;
}

HttpReply download(SavedFile file, const char* type) {
    for (char& c : file.name)
        if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 32) c = '_';
    return {.type = type,
            .body = std::move(file.bytes),
            .headers = {{"Content-Disposition", fmt::format("attachment; filename=\"{}\"", file.name)}}};
}

/// Replies with the first version of the status that knows of the changes.
HttpReply change(Viewer& viewer, const HttpRequest& request) {
    ChangeRequest wanted{.changes = readChanges(request.body)};
    if (const auto page = request.query.find("page"); page != request.query.end()) {
        wanted.page = page->second;
        wanted.first = numberIn(request, "first");
    }
    viewer.change(wanted);
    return {.type = "application/json",
            .body = fmt::format("{{\"version\": {}}}", viewer.state().now().version)};
}

}  // namespace

HttpReply answerPage(Viewer& viewer, const HttpRequest& request) {
    constexpr const char* kJson = "application/json";
    const std::string what = request.method + " " + request.path;
    if (what == "GET /") return wholePage();
    if (what == "GET /sight") return state(viewer, request);
    if (what == "POST /change") return change(viewer, request);
    if (what == "GET /pixel") {
        const auto at = [&](const char* key) {
            return static_cast<std::uint32_t>(std::min<std::uint64_t>(numberIn(request, key), 0xffffffffu));
        };
        return {.type = kJson, .body = viewer.pixel(at("x"), at("y"))};
    }
    if (what == "GET /devices") return {.type = kJson, .body = viewer.devices()};
    if (what == "GET /image.exr") return download(viewer.exr(), "image/x-exr");
    if (what == "GET /image.png") return download(viewer.png(), "image/png");
    return {.status = 404, .body = "no such page\n"};
}

}  // namespace crt
