"""Markdown tables, and pages whose tables and pictures are made anew between marks that carry their names."""

import argparse
import re


def arguments(doc, scratch, made):
    """The words of a bench that writes a page; `made`: what `--only` chooses from."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/crumple")
    parser.add_argument("--structures", default="target/release/structures")
    parser.add_argument("--scratch", default=scratch)
    parser.add_argument("--example", default="examples/hat-section")
    parser.add_argument("--fine", default="../shared/data/hat-section-fine")
    parser.add_argument("--only", nargs="*", help=f"{made} to make, by name")
    parser.add_argument("--write", help="page whose tables are replaced")
    return parser.parse_args()


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
