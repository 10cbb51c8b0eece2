/// The requests of pages → what a Viewer says.
#pragma once

#include "view/http_server.h"
#include "view/viewer.h"

#include <string>

namespace crt {

/// The page itself at "/"; "/sight", which waits for something newer than the page has; "/change", "/pixel",
/// "/devices", "/image.exr". Throws crt::Error as the Viewer does.
HttpReply answerPage(Viewer& viewer, const HttpRequest& request);

}  // namespace crt
