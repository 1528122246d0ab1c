from .columns import columns_from_text as columns_from_text
from .inspection import Inspection as Inspection, inspect_export as inspect_export
from .reading import READERS as READERS, read_blocks as read_blocks, read_export as read_export
