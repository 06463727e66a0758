// Numbers as text: the tables and heads of LAMMPS' dumps in, tables out.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "arrays.hpp"

namespace nscd {

// A line is no longer than this: a row has some hundred bytes.
inline constexpr std::int64_t LONGEST_LINE = 1 << 16;
inline constexpr std::int64_t LARGEST_WHOLE = 0x7fffffff, LARGEST_STEP = std::int64_t{1} << 62;
inline constexpr double LARGEST_LENGTH = 1e30;

// The float64 nearest to a word: [+-] digits with or without a point, and an exponent; or nan or inf, in any case of
// letters. Beyond float64 it is ±∞ or ±0. Nothing else is a number.
std::optional<double> number_of(std::string_view word);

// Tables in a content, one below the other: start, end (bytes) and rows of each. Nothing where there is anything but
// `width` numbers in each row.
struct Table { std::int64_t start, end, rows; };
std::optional<Vector> text_rows(std::string_view content, std::span<const Table> tables, std::int64_t width);
// As LAMMPS writes them: int32 processes; of each, int32 how many numbers and these, float64.
std::optional<Vector> binary_rows(std::string_view content, std::span<const Table> tables, std::int64_t width);

// Finds the frames of a dump in blocks of its bytes, where their heads are of a known form: its lines, in which the bytes
// MARK and one of the kinds stand for a line of values.
class Scan {
public:
    static constexpr char MARK = 0, STEP = 's', TIME = 't', COUNT = 'c', BOX = 'b';
    // How it ends: at the end of the block; at a line that is not as it should be; in a last row that lacks words.
    enum End { MORE, STRANGE, SHORT };
    struct Frame {
        std::int64_t step, rows, line, offset, length;  // line: of the first row; offset, length: bytes of the table
        double values[7];                               // time, then lowest and highest x, y, z of the box
    };
    std::int64_t at = 0, lines = 0, rows_left = 0;      // place in the block, lines before it, rows left of the last frame
    std::int64_t last = -1;                             // step of the last frame
    std::vector<Frame> frames;

    // Go on in a block, `before` bytes from the beginning of the file, with tables of `width` columns.
    End run(std::string_view block, std::int64_t before, std::string_view form, std::int64_t width);

private:
    std::optional<End> pass_rows(std::string_view block, std::int64_t width);
    std::optional<End> read_head(std::string_view block, std::string_view form);
};

// A column of a table: numbers, whole numbers, or cells that are text already.
using Column = std::variant<In, std::span<const std::int64_t>, std::vector<std::string>>;
// CSV: commas, 1.0 where a number is none of the whole ones, empty where it is not finite. Else as in a dump: spaces, 1.
std::string table_of(std::span<const Column> columns, std::size_t rows, bool csv);
// A number as `table_of` writes it: as short as it can be and still the same when read.
void append_number(std::string& out, double value, bool csv);

}  // namespace nscd
