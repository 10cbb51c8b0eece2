/// `crt verify`: chooses backend and cases, runs them, shows them, and writes what came of them.
#pragma once

#include "judge/verify/case.h"

#include "backend/integrator.h"

#include <string>
#include <vector>

namespace crt::verify {

struct Arguments {
    std::string backend = "auto";          ///< A name, a path of a plugin, or "auto".
    std::string plugin_path;               ///< A directory to look for it first; empty: none.
    IntegratorOptions integrator;
    std::vector<std::string>
        cases;  ///< Ids, names or groups, also several with commas; empty: all of the level.
    Level level = Level::Commit;
    std::string output;                    ///< Directory for verify.json and verify.html; empty: none.
    bool list = false;
    bool markdown = false;                 ///< Print docs/stability.md with the figures of `suites` instead.
    std::vector<std::string> suites;       ///< verify.json files.
    bool quiet = false;
};

/// Exit code: 0 when every case passes, is refused as documented or does not apply; 7 when one fails or is
/// inconclusive; 128 + signal when interrupted. Throws crt::Error.
int verify(const Arguments& arguments);

}  // namespace crt::verify
