/// The message of a reader of files about a file that it refuses.
#pragma once

#include "catch.h"

#include "base/error.h"
#include "base/temporary_folder.h"

#include <string>

namespace crt::test {

/// Writes a file of that name; load(path) must throw a crt::Error of scenes, at that line of it, with these
/// words.
template <class Load>
void checkRefusedFile(const std::string& name, const std::string& text, int line, const std::string& words,
                      const Load& load) {
    const TemporaryFolder folder;
    const std::string path = folder.write(name, text);
    CAPTURE(text, words);
    try {
        load(path);
        FAIL_CHECK("accepted");
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        CHECK_THAT(e.what(), Contains(words));
        CHECK(e.place().file == path);
        CHECK(e.place().line == line);
    }
}

}  // namespace crt::test
