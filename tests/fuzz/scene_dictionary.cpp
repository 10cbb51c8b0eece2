// Prints every word that the schema knows (keys, choices, defaults) as a libFuzzer dictionary.
#include "scene/yaml/scene_schema.h"
#include "spectra/spectra.h"

#include <cstdio>
#include <set>
#include <string>

namespace {

/// In quotes, with what libFuzzer's parser would take for something else written as \xAB.
void printEntry(const std::string& word) {
    std::fputc('"', stdout);
    for (const unsigned char c : word) {
        if (c < 0x20 || c > 0x7e || c == '"' || c == '\\')
            std::printf("\\x%02X", c);
        else
            std::fputc(c, stdout);
    }
    std::puts("\"");
}

}  // namespace

int main() {
    std::set<std::string> words{
        "from_mtl", "a.obj", "a.mtl", "a.spd", "null",  "[",     "]",       "{",    "}",    "- ",
        ": ",       "&a ",   "*a",    "<<: ",  "---\n", "1e308", "-1e-308", ".inf", ".nan", "\n  "};
    for (const crt::SectionSchema& section : crt::sceneSchema())
        for (const crt::KeySchema& key : section.keys) {
            words.insert(key.name + ": ");
            words.insert(key.choices.begin(), key.choices.end());
            if (!key.fallback.empty()) words.insert(key.fallback);
        }
    for (const auto* names : {&crt::glassNames(), &crt::metalNames(), &crt::illuminantNames()})
        words.insert(names->begin(), names->end());
    for (const std::string& word : words) printEntry(word);
}
