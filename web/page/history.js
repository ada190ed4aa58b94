// What has happened in the run: rows of samples in a fixed amount of memory. A move of any length stays whole: when the
// memory is full, every second row is left out, and rows that come later are taken more rarely.

export class History {
  constructor(columns, capacity) {
    this.columns = columns;
    this.capacity = capacity;
    this.values = columns.map(() => new Float64Array(capacity));
    this.clear();
  }

  clear() {
    this.length = 0;
    this.every = 1;
    this.skipped = 0;
  }

  // Adds a row, a value for each column; `kept` are the numbers of columns that must not get lost, of which the largest
  // of the rows left out is kept.
  push(row, kept) {
    if (this.length > 0 && this.skipped + 1 < this.every) {
      this.skipped += 1;
      for (const column of kept) this.keepLarger(column, this.length - 1, row[column]);
      return;
    }
    this.skipped = 0;
    if (this.length === this.capacity) this.halve(kept);
    this.columns.forEach((_, column) => { this.values[column][this.length] = row[column]; });
    this.length += 1;
  }

  keepLarger(column, at, value) {
    if (Math.abs(value) > Math.abs(this.values[column][at])) this.values[column][at] = value;
  }

  halve(kept) {
    for (let from = 0; 2 * from < this.length; from += 1) {
      this.columns.forEach((_, column) => {
        const [one, other] = [this.values[column][2 * from], this.values[column][2 * from + 1]];
        const larger = kept.includes(column) && Math.abs(other) > Math.abs(one);
        this.values[column][from] = larger ? other : one;
      });
    }
    this.length = Math.ceil(this.length / 2);
    this.every *= 2;
  }

  // The first row at or after a time, which is the first column.
  since(time) {
    let [low, high] = [0, this.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.values[0][middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
