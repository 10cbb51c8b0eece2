#include "view/page_changes.h"

#include <algorithm>

namespace crt {

bool PageChanges::take(const std::string& page, std::uint64_t number) {
    const auto found =
        std::find_if(newest_.begin(), newest_.end(), [&](const auto& each) { return each.first == page; });
    if (found == newest_.end()) {
        if (newest_.size() == kMostPages) newest_.erase(newest_.begin());
        newest_.emplace_back(page, number);
        return true;
    }
    std::rotate(found, found + 1, newest_.end());
    if (number <= newest_.back().second) return false;
    newest_.back().second = number;
    return true;
}

}  // namespace crt
