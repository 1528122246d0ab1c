"""``python -m tribo`` runs the command tribo."""

from tribo.cli import main

if __name__ == "__main__":
    main(prog_name="tribo")
