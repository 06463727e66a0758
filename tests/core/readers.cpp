// Dumps, cut, changed and made of random bytes, through the readers of text and binary tables and the scan of heads, for the
// sanitizers (`make sanitize`). What is read is compared with strtod, and what is written is read back.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>

#include "dump_text.hpp"

using namespace nscd;
using namespace std::string_literals;

namespace {

std::mt19937_64 draw(1);

std::size_t below(std::size_t limit) { return draw() % limit; }

bool report(const char* what, std::string_view text, bool passed) {
    if (!passed) std::printf("%s: wrong for %.*s\n", what, int(std::min<std::size_t>(text.size(), 200)), text.data());
    return passed;
}

bool same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)); }

// The bytes without room behind them, so that a byte too far is seen.
std::vector<char> exact(std::string_view text) { return {text.begin(), text.end()}; }
std::string_view view(const std::vector<char>& bytes) { return {bytes.data(), bytes.size()}; }

double any_number() {
    const std::uint64_t bits = draw();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return below(3) ? double(std::int64_t(bits) >> below(63)) * 1e-6 : value;
}

std::string text_dump(int frames, int rows) {
    std::string dump;
    for (int f = 0; f < frames; ++f) {
        dump += "ITEM: TIMESTEP\n" + std::to_string(10 * f) + "\nITEM: TIME\n" + std::to_string(0.1 * f) + "\nITEM: NUMBER OF ATOMS\n" +
                std::to_string(rows) + "\nITEM: BOX BOUNDS ff ff pp\n-1.0e+00 5\n0 7.25\n-0.5 0.5\nITEM: ATOMS id x y\n";
        Vector x, y;
        std::vector<std::int64_t> id;
        for (int i = 0; i < rows; ++i) id.push_back(i + 1), x.push_back(any_number()), y.push_back(any_number());
        dump += table_of(std::vector<Column>{std::span<const std::int64_t>(id), In(x), In(y)}, rows, false);
    }
    return dump;
}

std::string form() {
    const auto value = [](char kind) { return std::string{Scan::MARK, kind, '\n'}; };
    return "ITEM: TIMESTEP\n" + value(Scan::STEP) + "ITEM: TIME\n" + value(Scan::TIME) + "ITEM: NUMBER OF ATOMS\n" + value(Scan::COUNT) +
           "ITEM: BOX BOUNDS ff ff pp\n" + value(Scan::BOX) + value(Scan::BOX) + value(Scan::BOX) + "ITEM: ATOMS id x y\n";
}

// Bytes are put elsewhere, changed, cut off, or all random.
void spoil(std::string& text) {
    static const std::string LIKELY = "0123456789+-.eEnaif \n\t\r\0ITEM:";
    for (std::size_t times = below(8); times > 0 && !text.empty(); --times) {
        const std::size_t at = below(text.size());
        switch (below(5)) {
            case 0: text[at] = LIKELY[below(LIKELY.size())]; break;
            case 1: text[at] = char(draw()); break;
            case 2: text.resize(at); break;
            case 3: text.insert(at, text.substr(below(text.size()), below(40))); break;
            case 4: text.erase(at, below(40)); break;
        }
    }
    if (below(50) == 0)
        for (char& sign : text) sign = char(draw());
}

// All frames, the file in blocks of a size; and their tables.
int scanned(const std::string& dump, std::size_t block, const std::string& head) {
    Scan scan;
    std::vector<char> stored;
    std::int64_t before = 0;
    int frames = 0;
    for (std::size_t at = 0; at <= dump.size(); at += block) {
        stored = exact(std::string(stored.begin() + scan.at, stored.end()) + dump.substr(at, block));
        before += scan.at, scan.at = 0;
        if (scan.run(view(stored), before, head, 3) != Scan::MORE) break;
    }
    for (const Scan::Frame& frame : scan.frames) {
        const Table table{frame.offset, frame.offset + frame.length, frame.rows};
        frames += text_rows(dump, {&table, 1}, 3).has_value();
    }
    return frames;
}

bool words() {
    bool passed = true;
    for (int i = 0; i < 100'000; ++i) {
        std::string word;
        append_number(word, any_number(), below(2));
        if (word.empty()) continue;  // CSV has no NaN
        const auto value = number_of(word);
        passed = report("number", word, value && same(*value, std::strtod(word.c_str(), nullptr))) && passed;
        spoil(word);
        // what strtod reads besides: spaces in front, hexadecimals, infinity, nan(1)
        const bool plain = word.find_first_not_of("0123456789+-.eE") == word.npos && !word.empty();
        char* end = nullptr;
        const double wanted = std::strtod(word.c_str(), &end);
        const auto found = number_of(word);
        if (plain) passed = report("word", word, found.has_value() == (*end == 0) && (!found || same(*found, wanted))) && passed;
    }
    const std::string zeros(400, '0');
    for (const std::string& word : {"-1e999"s, "-1e-999"s, "0." + zeros + "1e50", "1" + zeros + "e-50", "1e99999999999999999999"s, "1e-99999999999999999999"s})
        passed = report("beyond", word, number_of(word) && same(*number_of(word), std::strtod(word.c_str(), nullptr))) && passed;
    for (const char* word : {"", "+", ".", "e5", "infinity", "nan(1)", "0x1p3", "+-1", "1e", "1_0"})
        passed = report("no number", word, !number_of(word)) && passed;
    return passed;
}

bool texts() {
    bool passed = report("dump", "of text", scanned(text_dump(3, 20), 100, form()) == 3);
    for (int i = 0; i < 20'000; ++i) {
        std::string dump = text_dump(int(below(4)), int(below(6))), head = form();
        spoil(dump);
        if (below(5) == 0) spoil(head);
        scanned(dump, 1 + below(400), head);
    }
    return passed;
}

// A table, whole and spoiled, by both readers.
bool tables() {
    bool passed = true;
    for (int i = 0; i < 20'000; ++i) {
        const bool binary = below(2);
        const std::int64_t width = 1 + below(4), rows = below(9);
        std::string dump(binary ? 4 : 0, '\0');
        Vector values;
        for (std::int64_t left = rows * width; left > 0;) {
            const std::int64_t some = binary ? 1 + below(left) : width;
            const auto count = std::int32_t(some);
            if (binary) dump.append(reinterpret_cast<const char*>(&count), 4);
            for (std::int64_t n = 0; n < some; ++n) {
                values.push_back(any_number());
                if (binary) dump.append(reinterpret_cast<const char*>(&values.back()), 8);
                else append_number(dump, values.back() += 0.0, false), dump += n + 1 < some ? ' ' : '\n';
            }
            left -= some;
        }
        const auto read = [&](std::string_view content, const Table& table) {
            return binary ? binary_rows(content, {&table, 1}, width) : text_rows(content, {&table, 1}, width);
        };
        const auto found = read(dump, {0, std::int64_t(dump.size()), rows});
        bool all = found && found->size() == values.size();
        for (std::size_t n = 0; all && n < values.size(); ++n) all = same((*found)[n], values[n]);
        passed = report("table", dump, all) && passed;
        spoil(dump);
        const std::vector<char> content = exact(dump);
        const auto size = std::int64_t(content.size());
        read(view(content), {0, size, rows});
        read(view(content), {std::int64_t(below(9)), size + std::int64_t(below(3)), std::int64_t(draw() >> below(64))});
    }
    return passed;
}

}  // namespace

int main() {
    const bool passed[] = {words(), texts(), tables()};
    return passed[0] && passed[1] && passed[2] ? 0 : 1;
}
