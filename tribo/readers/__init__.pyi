from .core.export import read_blocks as read_blocks, read_export as read_export
from .core.given import columns_from_text as columns_from_text
from .core.inspect import Inspection as Inspection, inspect_export as inspect_export
from .families import READERS as READERS
