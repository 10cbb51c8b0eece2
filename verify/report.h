/// The formats in which a run of the suite is written.
#pragma once

#include "verify/run.h"

#include <string>
#include <vector>

namespace crt::verify {

/// One line: "A03  square-light   pass   0.8 s", and below it each outcome that failed, with the physics
/// that its figures suggest.
std::string caseText(const CaseResult& result, bool colored);
/// "51 pass, 2 not applicable, 1 FAIL in 43 s".
std::string summaryText(const SuiteResult& suite);

/// verify.json
std::string suiteJson(const SuiteResult& suite);

/// `crt verify --list`
std::string listText(const std::vector<const Case*>& cases);
/// The row of a case in docs/stability.md, but for the figures that end it.
std::string markdownRow(const Case& c);
/// docs/stability.md: every case of the registry, with the figures of `suites` (verify.json texts) where
/// they have any; those of one backend, such as the parts of one run, share a column. Made, never written
/// by hand.
std::string registryMarkdown(const std::vector<std::string>& suites);

}  // namespace crt::verify
