"""What other people's readers find in the logs of one run: `mcap` with protobuf, and `pyarrow`.

    python3 tests/logs/readers.py RUN.mcap RUN.parquet RUN.csv

prints one JSON object, which `tests/system/command/tool_logs.rs` compares. It runs in the environment that
`tests/logs/environment.sh` makes.
"""

import json
import math
import sys

import pyarrow.csv
import pyarrow.parquet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def of_mcap(path):
    """Counts and values by topic, and what stands beside the messages."""
    topics = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            topic = topics.setdefault(channel.topic, {"schema": schema.name, "count": 0, "first": None, "sums": {}})
            topic["count"] += 1
            fields = {field.name: getattr(decoded, field.name) for field in decoded.DESCRIPTOR.fields}
            topic["last"] = dict(fields, log_time=message.log_time)
            topic["first"] = topic["first"] or topic["last"]
            for name, value in fields.items():
                if isinstance(value, (int, float)) and math.isfinite(value):
                    topic["sums"][name] = topic["sums"].get(name, 0.0) + value
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {record.name: record.data.decode() for record in reader.iter_attachments()}
    return {
        "topics": topics,
        "messages": summary.statistics.message_count,
        "chunks": len(summary.chunk_indexes),
        "metadata": metadata,
        "attachments": attachments,
    }


def of_table(table):
    """How many cells each column has, and their sum."""
    columns = {}
    for name in table.column_names:
        cells = [cell for cell in table.column(name).to_pylist() if cell is not None and cell != ""]
        numbers = [cell for cell in cells if not isinstance(cell, str)]
        total = 0.0
        for number in numbers:
            total += number
        columns[name] = {"count": len(cells), "sum": total, "last": cells[-1] if cells else None}
    return {"rows": table.num_rows, "columns": columns}


def found(path):
    if path.endswith(".mcap"):
        return of_mcap(path)
    if path.endswith(".parquet"):
        facts = pyarrow.parquet.read_schema(path).metadata
        table = of_table(pyarrow.parquet.read_table(path))
        return dict(table, metadata={key.decode(): value.decode() for key, value in facts.items()})
    return of_table(pyarrow.csv.read_csv(path))


print(json.dumps({path: found(path) for path in sys.argv[1:]}).replace("NaN", "null"))
