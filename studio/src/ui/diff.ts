export interface DiffRow {
  mine: string | null;
  theirs: string | null;
  same: boolean;
}

/** Two texts line by line, equal lines side by side (longest common subsequence); null for missing counterparts. */
export function diffLines(mine: string, theirs: string): DiffRow[] {
  const [a, b] = [mine.split("\n"), theirs.split("\n")];
  const width = b.length + 1;
  const common = new Uint32Array((a.length + 1) * width);
  for (let i = a.length - 1; i >= 0; --i) {
    for (let j = b.length - 1; j >= 0; --j) {
      common[i * width + j] =
        a[i] === b[j]
          ? common[(i + 1) * width + j + 1]! + 1
          : Math.max(common[(i + 1) * width + j]!, common[i * width + j + 1]!);
    }
  }
  const rows: DiffRow[] = [];
  let [i, j] = [0, 0];
  while (i < a.length || j < b.length) {
    if (i < a.length && j < b.length && a[i] === b[j]) {
      rows.push({ mine: a[i++]!, theirs: b[j++]!, same: true });
    } else if (j === b.length || (i < a.length && common[(i + 1) * width + j]! >= common[i * width + j + 1]!)) {
      rows.push({ mine: a[i++]!, theirs: null, same: false });
    } else {
      rows.push({ mine: null, theirs: b[j++]!, same: false });
    }
  }
  return rows;
}
