"""Reads the results of a campaign with pyarrow: the table is that of the CSV, and the file says what it holds.

    python3 read_parquet.py DIRECTORY

Prints what is left to check as JSON.
"""

import json
import sys
from pathlib import Path

import pyarrow.csv
import pyarrow.parquet

directory = Path(sys.argv[1])
table = pyarrow.parquet.read_table(directory / "runs.parquet")
assert not any(set("[]() ") & set(name) for name in table.column_names), table.column_names
kinds = {name: table.schema.field(name).type for name in table.column_names}
# Empty cells are absent numbers, and words may be empty.
options = pyarrow.csv.ConvertOptions(column_types=kinds, strings_can_be_null=False)
assert table.equals(pyarrow.csv.read_csv(directory / "runs.csv", convert_options=options).cast(table.schema))

file = pyarrow.parquet.read_metadata(directory / "runs.parquet")
said = {key.decode(): value.decode() for key, value in file.metadata.items()}
assert said["gyrfalcon.definition"] == (directory / "campaign.toml").read_text()
units, meanings = json.loads(said["gyrfalcon.units"]), json.loads(said["gyrfalcon.meanings"])
assert set(units) <= set(table.column_names) and set(meanings) == set(table.column_names)
columns = [file.row_group(0).column(number) for number in range(file.num_columns)]
print(json.dumps({
    "campaign": said["gyrfalcon.campaign"],
    "version": said["gyrfalcon.version"],
    "commit": said["gyrfalcon.commit"],
    "created_by": file.created_by,
    "rows": table.num_rows,
    "units": units,
    "compression": sorted({column.compression for column in columns}),
    "dictionaries": [column.path_in_schema for column in columns if column.has_dictionary_page],
}))
