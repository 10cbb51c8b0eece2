/// Runs cases one after another and keeps what came of them.
#pragma once

#include "render/watch.h"
#include "verify/context.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace crt::verify {

struct CaseResult {
    const Case* which = nullptr;
    Verdict verdict = Verdict::Fail;
    std::vector<Outcome> outcomes;
    double seconds = 0;
};

struct SuiteResult {
    std::string backend, version, build, device;
    Level level = Level::Commit;
    std::vector<CaseResult> cases;
    /// That ended the run early: the case in which it came, and those after, are missing.
    std::optional<StopRequest> request;
    std::size_t asked = 0;  ///< Cases that were to run.
    double seconds = 0;

    std::size_t count(Verdict verdict) const;
    bool passed() const;
};

/// Called before each case with null, after it with its result.
using CaseShown = std::function<void(const Case& next, std::size_t index, const CaseResult* result)>;

/// Runs the cases. A case whose backend throws fails; the others go on.
SuiteResult runCases(const LoadedBackend& backend, const IntegratorOptions& options, Level level,
                     const std::vector<const Case*>& cases, const CaseShown& show, Watch& watch);

}  // namespace crt::verify
