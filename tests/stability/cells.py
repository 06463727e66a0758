"""Rows of cases by their labels, and single attempts."""

from analysis.studies.stability.atlas import choose


def row_of(name, label):
    """The row of a case that is called so; the label itself where no row is."""
    (case,) = choose([name], quick=False)
    rows = (*case.rows.values, *case.few_rows)
    return case, next((row for row in rows if str(row) == str(label)), label)


def cell_of(name, column, label, folder):
    case, row = row_of(name, label)
    return case.attempt(column, row, folder)


def theory(name, label):
    case, row = row_of(name, label)
    return case.theory(row)
