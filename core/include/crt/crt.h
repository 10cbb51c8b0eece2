/// libcrt: all of it (docs/embedding.md).
#pragma once

#include <crt/error.h>
#include <crt/film.h>
#include <crt/image.h>
#include <crt/plugins.h>
#include <crt/render.h>
#include <crt/scene.h>
#include <crt/watch.h>
