"""Markdown tables, and pages whose tables and pictures are made anew between marks that carry their names."""

import re


def table(head, rows, text=1):
    """A Markdown table; the first `text` columns hold words, the others numbers."""
    line = lambda cells: "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"
    return "\n".join([line(head), line(["---"] * text + ["---:"] * (len(head) - text))] + [line(row) for row in rows])


def write(path, made):
    """Puts tables between their marks on a page."""
    with open(path) as file:
        page = file.read()
    for name, text in made.items():
        page, found = re.subn(
            f"(<!-- table: {re.escape(name)} -->\n).*?(<!-- end -->)", lambda match: f"{match[1]}\n{text}\n\n{match[2]}", page, flags=re.S
        )
        if not found:
            print(f"{path} has no place for the table '{name}'")
    with open(path, "w") as file:
        file.write(page)
