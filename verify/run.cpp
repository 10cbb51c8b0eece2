#include "verify/run.h"

#include "compile/compile.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>

namespace crt::verify {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

Outcome thrown(const std::string& message) {
    Outcome o;
    o.what = "runs to its end";
    o.tolerance = "no error";
    o.note = message;
    o.physics = "the case could not be answered";
    return o;
}

CaseResult runCase(const Case& which, Context& context) {
    CaseResult result;
    result.which = &which;
    const Clock::time_point start = Clock::now();
    const std::uint64_t lacking = which.needs & ~context.backend().table->features;
    if (lacking != 0) {
        context.notApplicable(which.title,
                              fmt::format("the backend was built without {}", featureNames(lacking)));
    } else {
        try {
            which.run(context);
        } catch (const std::exception& error) {
            context.add(thrown(error.what()));
        }
    }
    result.outcomes = context.take();
    result.verdict = worst(result.outcomes);
    result.seconds = secondsSince(start);
    return result;
}

}  // namespace

std::size_t SuiteResult::count(Verdict verdict) const {
    return static_cast<std::size_t>(std::count_if(
        cases.begin(), cases.end(), [&](const CaseResult& c) { return c.verdict == verdict; }));
}

bool SuiteResult::passed() const {
    return cases.size() == asked &&
           std::none_of(cases.begin(), cases.end(), [](const CaseResult& c) { return failed(c.verdict); });
}

SuiteResult runCases(const LoadedBackend& backend, const IntegratorOptions& options, Level level,
                     const std::vector<const Case*>& cases, const CaseShown& show, Watch& watch) {
    const Clock::time_point start = Clock::now();
    SuiteResult suite;
    suite.backend = backend.name;
    suite.version = backend.table->version;
    suite.build = backend.table->build;
    suite.level = level;
    suite.asked = cases.size();
    const std::vector<CrtDevice> devices = probeDevices(backend);
    suite.device = devices.front().name;
    Context context(backend, options, level, watch);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        suite.request = watch.stopRequested();
        if (suite.request) break;
        show(*cases[i], i, nullptr);
        try {
            suite.cases.push_back(runCase(*cases[i], context));
        } catch (const Stopped& stopped) {
            suite.request = stopped.request;
            break;
        }
        show(*cases[i], i, &suite.cases.back());
    }
    suite.seconds = secondsSince(start);
    return suite;
}

}  // namespace crt::verify
