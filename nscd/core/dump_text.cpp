#include "dump_text.hpp"

#include <bit>
#include <charconv>
#include <cstring>

namespace nscd {

namespace {

static_assert(std::endian::native == std::endian::little, "numbers in binary dumps are little-endian");

bool is_digit(char sign) { return unsigned(sign - '0') < 10; }
bool is_space(char sign) { return sign == ' ' || sign == '\t' || sign == '\r'; }

// What digits (with a point and an exponent) beyond float64 are: ∞, or 0.
double beyond(std::string_view digits) {
    std::int64_t power = 0, exponent = 0;  // 10^power is the place of the first digit that is not 0
    bool point = false, begun = false;
    std::size_t at = 0;
    for (; at < digits.size() && (digits[at] | 32) != 'e'; ++at) {
        if (digits[at] == '.') { point = true; continue; }
        begun = begun || digits[at] != '0';
        power += begun ? !point : -point;
    }
    at += at + 1 < digits.size() && digits[at + 1] == '+' ? 2 : 1;
    if (at < digits.size()) {
        const bool more = std::from_chars(digits.data() + at, digits.data() + digits.size(), exponent).ec != std::errc{};
        if (more) return digits[at] == '-' ? 0.0 : INFINITE;
    }
    return power + exponent > 0 ? INFINITE : 0.0;
}

// Read the number at the front of a text; where it ends, or nowhere.
const char* read_number(const char* at, const char* end, double& value) {
    const bool minus = at < end && *at == '-';
    if (at < end && (minus || *at == '+')) ++at;
    const char* first = at;
    if (at == end) return nullptr;
    if (is_digit(*at) || *at == '.') {
        const auto [stop, error] = std::from_chars(at, end, value);
        if (error == std::errc::invalid_argument) return nullptr;
        at = stop;
        if (error == std::errc::result_out_of_range) value = beyond({first, at});
    } else {
        if (end - at < 3) return nullptr;
        char word[3];
        for (int i = 0; i < 3; ++i) word[i] = char(at[i] | 32);
        const std::string_view name(word, 3);
        if (name == "nan") value = std::numeric_limits<double>::quiet_NaN();
        else if (name == "inf") value = INFINITE;
        else return nullptr;
        at += 3;
    }
    if (minus) value = -value;
    return at;
}

// Read a row of a table to behind the end of its line; nowhere where it has not `width` numbers.
const char* read_row(const char* at, const char* end, std::int64_t width, double* values) {
    for (std::int64_t word = 0; ; ++at) {
        if (at == end) return nullptr;
        if (is_space(*at)) continue;
        if (*at == '\n') return word == width ? at + 1 : nullptr;
        if (word == width) return nullptr;
        at = read_number(at, end, values[word++]);
        if (!at || at == end || static_cast<unsigned char>(*at) > ' ') return nullptr;
        --at;
    }
}

// How many numbers tables have, each of which takes `minimum` bytes; nothing where they do not lie in the content.
std::optional<std::int64_t> count_of(std::string_view content, std::span<const Table> tables, std::int64_t width, std::int64_t minimum) {
    std::int64_t rows = 0;
    for (const Table& table : tables) {
        if (table.start < 0 || table.end < table.start || table.end > std::int64_t(content.size()) || table.rows < 0 || width < 0) return {};
        if (width > 0 && table.rows > (table.end - table.start) / minimum / width) return {};
        rows += table.rows;
    }
    return rows * width;
}

// Start and stop of the next word of a line.
std::pair<std::size_t, std::size_t> word_at(std::string_view text, std::size_t at) {
    while (at < text.size() && is_space(text[at])) ++at;
    const std::size_t start = at;
    while (at < text.size() && static_cast<unsigned char>(text[at]) > ' ') ++at;
    return {start, at};
}

std::int64_t words_of(std::string_view line) {
    std::int64_t count = 0;
    bool within = false;
    for (char sign : line) {
        const bool blank = sign == ' ' || (sign >= '\t' && sign <= '\r');
        count += !blank && !within;
        within = !blank;
    }
    return count;
}

template <class Number>
char* append_shortest(char* at, Number value) { return std::to_chars(at, at + 32, value).ptr; }

// 32 bytes are enough.
char* append_cell(char* at, double value, bool csv) {
    if (!std::isfinite(value)) {
        if (csv) return at;
        const std::string_view word = value > 0.0 ? "inf" : value < 0.0 ? "-inf" : "nan";
        return at + word.copy(at, word.size());
    }
    char* end = append_shortest(at, value + 0.0);  // + 0: no negative zeros
    if (!csv) return end;
    for (const char* sign = at; sign < end; ++sign)
        if (!is_digit(*sign) && *sign != '-') return end;
    *end++ = '.', *end++ = '0';
    return end;
}

}  // namespace

std::optional<double> number_of(std::string_view word) {
    double value;
    const char* end = word.data() + word.size();
    if (read_number(word.data(), end, value) != end) return {};
    return value;
}

std::optional<Vector> text_rows(std::string_view content, std::span<const Table> tables, std::int64_t width) {
    const auto count = count_of(content, tables, width, 2);
    if (!count) return {};
    Vector values(*count);
    double* cell = values.data();
    for (const Table& table : tables) {
        const char *at = content.data() + table.start, *end = content.data() + table.end;
        for (std::int64_t row = 0; row < table.rows; ++row, cell += width) {
            at = read_row(at, end, width, cell);
            if (!at) return {};
        }
        for (; at != end; ++at)
            if (!is_space(*at)) return {};
    }
    return values;
}

std::optional<Vector> binary_rows(std::string_view content, std::span<const Table> tables, std::int64_t width) {
    const auto count = count_of(content, tables, width, sizeof(double));
    if (!count) return {};
    Vector values(*count);
    auto* to = reinterpret_cast<char*>(values.data());
    for (const Table& table : tables) {
        std::int64_t at = table.start + 4, left = 8 * table.rows * width;
        while (at + 4 <= table.end) {
            std::int32_t some;
            std::memcpy(&some, content.data() + at, 4);
            const std::int64_t bytes = 8 * std::int64_t(some);
            at += 4;
            if (bytes < 0 || bytes > left || bytes > table.end - at) return {};
            if (bytes) std::memcpy(to, content.data() + at, bytes);
            at += bytes, to += bytes, left -= bytes;
        }
        if (left || at != table.end) return {};
    }
    return values;
}

std::optional<Scan::End> Scan::pass_rows(std::string_view block, std::int64_t width) {
    for (; rows_left > 0; --rows_left, ++lines) {
        const std::string_view window = block.substr(at, LONGEST_LINE);
        const std::size_t end = window.find('\n');
        const std::string_view line = window.substr(0, end);
        if (line.find('\0') != line.npos) return STRANGE;
        if (end == window.npos) return window.size() < std::size_t(LONGEST_LINE) ? MORE : STRANGE;
        if (rows_left == 1 && words_of(line) < width) return SHORT;
        at += end + 1;
    }
    return {};
}

std::optional<Scan::End> Scan::read_head(std::string_view block, std::string_view form) {
    Frame frame{};
    std::size_t here = at;
    std::int64_t ends = 0;
    int bounds = 1;
    if (form.empty()) return STRANGE;
    for (std::size_t k = 0; k < form.size(); ++k) {
        if (form[k] != MARK) {
            if (here == block.size()) return MORE;
            if (block[here++] != form[k]) return STRANGE;
            ends += form[k] == '\n';
            continue;
        }
        const char kind = ++k < form.size() ? form[k] : MARK;
        for (int values = kind == BOX ? 2 : 1; values > 0; --values) {
            const auto [start, stop] = word_at(block, here);
            if (stop == block.size()) return std::int64_t(stop) - at < LONGEST_LINE ? MORE : STRANGE;
            const std::string_view word = block.substr(start, stop - start);
            here = stop;
            if (kind == STEP || kind == COUNT) {
                std::int64_t& count = kind == STEP ? frame.step : frame.rows;
                const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
                if (word.empty() || !is_digit(word[0]) || end != word.data() + word.size() || error != std::errc{}) return STRANGE;
                if (count > (kind == STEP ? LARGEST_STEP : LARGEST_WHOLE)) return STRANGE;
            } else {
                if (bounds == 7) return STRANGE;
                const auto value = number_of(word);
                if (!value || !(std::abs(*value) <= LARGEST_LENGTH)) return STRANGE;
                frame.values[kind == BOX ? bounds++ : 0] = *value;
            }
        }
        here = word_at(block, here).first;
    }
    if (frame.step <= last) return STRANGE;
    at = std::int64_t(here), last = frame.step, rows_left = frame.rows, lines += ends;
    frame.line = lines + 1;
    frames.push_back(frame);
    return {};
}

Scan::End Scan::run(std::string_view block, std::int64_t before, std::string_view form, std::int64_t width) {
    if (at < 0 || at > std::int64_t(block.size())) return STRANGE;
    while (true) {
        if (rows_left > 0 && !frames.empty()) {
            const std::int64_t start = at;
            const auto end = pass_rows(block, width);
            frames.back().length += at - start;
            if (end) return *end;
        }
        if (at == std::int64_t(block.size())) return MORE;
        if (const auto end = read_head(block, form)) return *end;
        frames.back().offset = before + at;
    }
}

void append_number(std::string& out, double value, bool csv) {
    char cell[32];
    out.append(cell, append_cell(cell, value, csv));
}

std::string table_of(std::span<const Column> columns, std::size_t rows, bool csv) {
    struct Before { double value = std::numeric_limits<double>::quiet_NaN(); char cell[32]; int size = -1; };
    std::vector<Before> before(columns.size());  // what is as in the row above is copied
    const std::size_t row_size = 33 * columns.size();
    std::string out;
    std::size_t size = 0;
    for (std::size_t row = 0; row < rows; ++row) {
        if (out.size() < size + row_size) out.resize(2 * out.size() + row_size * std::min<std::size_t>(rows, 64));
        for (std::size_t c = 0; c < columns.size(); ++c) {
            char* at = out.data() + size;
            if (const auto* floats = std::get_if<In>(&columns[c])) {
                const double value = (*floats)[row];
                Before& same = before[c];
                if (same.size < 0 || std::bit_cast<std::uint64_t>(value) != std::bit_cast<std::uint64_t>(same.value)) {
                    same.value = value;
                    same.size = int(append_cell(same.cell, value, csv) - same.cell);
                }
                std::memcpy(at, same.cell, sizeof same.cell);
                at += same.size;
            } else if (const auto* integers = std::get_if<std::span<const std::int64_t>>(&columns[c])) {
                at = append_shortest(at, (*integers)[row]);
            } else {
                const std::string& cell = std::get<std::vector<std::string>>(columns[c])[row];
                size = at - out.data();
                const std::size_t needed = size + cell.size() + row_size;
                if (out.size() < needed) out.resize(2 * out.size() + needed);
                at = out.data() + size;
                at += cell.copy(at, cell.size());
            }
            *at++ = c + 1 == columns.size() ? '\n' : csv ? ',' : ' ';
            size = at - out.data();
        }
    }
    out.resize(size);
    return out;
}

}  // namespace nscd
